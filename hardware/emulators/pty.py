"""A port of our own: a pseudo-terminal behind a symbolic link, which can be unplugged and plugged in again under the same name."""

import contextlib
import os
import select
import tty
from pathlib import Path

CHUNK = 4096


class PseudoTerminal:
    """The device's end. What is said while nobody has the port open is lost, as on a real wire."""

    def __init__(self, link: Path) -> None:
        self.link, self._fd = link, -1
        self.listened = False  # whether somebody has it open, as of the last look

    @property
    def plugged(self) -> bool:
        """Whether it is there."""
        return self._fd >= 0

    def fileno(self) -> int:
        """For select."""
        return self._fd

    def plug(self) -> None:
        """A new pseudo-terminal under the same name."""
        self._fd, theirs = os.openpty()
        tty.setraw(theirs)
        path = os.ttyname(theirs)
        os.close(theirs)  # or we could not tell whether somebody has it open
        os.set_blocking(self._fd, False)
        self.link.symlink_to(path)

    def unplug(self) -> None:
        """Gone: whoever has it open reads its end."""
        if self.plugged:
            os.close(self._fd)
            self._fd, self.listened = -1, False
        self.link.unlink(missing_ok=True)

    def look(self) -> None:
        """See whether somebody has it open now."""
        if self.plugged:
            poll = select.poll()
            poll.register(self._fd, select.POLLIN)
            self.listened = not any(event & select.POLLHUP for _, event in poll.poll(0))

    def read(self) -> bytes:
        """What has come in."""
        try:
            return os.read(self._fd, CHUNK)
        except BlockingIOError:
            return b""
        except OSError:  # nobody has it open any more
            self.listened = False
            return b""

    def write(self, data: bytes) -> None:
        """As much as the other end takes: nobody reads what overflows."""
        if self.plugged and self.listened:
            with contextlib.suppress(OSError):
                os.write(self._fd, data)
