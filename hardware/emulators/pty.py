"""Pseudo-terminal behind a symbolic link, as an emulated port that can be unplugged and replugged under the same name."""

import contextlib
import os
import select
import tty
from pathlib import Path

CHUNK = 4096


class PseudoTerminal:
    """Device end of a pseudo-terminal. Bytes written while no host has the port open are lost, as on a real wire."""

    def __init__(self, link: Path) -> None:
        self.link, self._fd = link, -1
        self.listened = False  # whether a host has it open, as of the last check

    @property
    def plugged(self) -> bool:
        """Whether the port exists."""
        return self._fd >= 0

    def fileno(self) -> int:
        """File descriptor, for select."""
        return self._fd

    def plug(self) -> None:
        """Create a new pseudo-terminal under the same name."""
        self._fd, host_fd = os.openpty()
        tty.setraw(host_fd)
        path = os.ttyname(host_fd)
        os.close(host_fd)  # else an open host end could not be detected
        os.set_blocking(self._fd, False)
        self.link.symlink_to(path)

    def unplug(self) -> None:
        """Remove the port: a host that has it open reads end of file."""
        if self.plugged:
            os.close(self._fd)
            self._fd, self.listened = -1, False
        self.link.unlink(missing_ok=True)

    def look(self) -> None:
        """Update whether a host has the port open."""
        if self.plugged:
            poll = select.poll()
            poll.register(self._fd, select.POLLIN)
            self.listened = not any(event & select.POLLHUP for _, event in poll.poll(0))

    def read(self) -> bytes:
        """Return the bytes received."""
        try:
            return os.read(self._fd, CHUNK)
        except BlockingIOError:
            return b""
        except OSError:  # no host has it open any more
            self.listened = False
            return b""

    def write(self, data: bytes) -> None:
        """Write as much as the buffer takes; the rest is lost."""
        if self.plugged and self.listened:
            with contextlib.suppress(OSError):
                os.write(self._fd, data)
