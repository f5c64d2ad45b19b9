"""A serial port as drivers see it: bytes in, bytes out, and `Unplugged` when it is gone. Opened by nobody else at the same time."""

import contextlib
import errno
import fcntl
import select
import termios
from typing import Protocol

import serial

from oio.core.errors import BadInput, OioError

WRITE_S = 2.0  # a port that takes nothing for so long is gone


class Unplugged(Exception):
    """The port went away, or the device behind it answers nothing any more; it may come back."""


class NoAnswer(Exception):
    """A device did not answer in time."""


class Wire(Protocol):
    """An open port."""

    def read(self, timeout_s: float) -> bytes:
        """What has come in; waits for a first byte at most so long, b"" if none came. Raises Unplugged."""
        ...

    def write(self, data: bytes) -> None:
        """All of it. Raises Unplugged."""
        ...

    def close(self) -> None:
        """Let the port go; never raises."""
        ...


class SerialWire:
    """pyserial's port."""

    def __init__(self, path: str, baud: int) -> None:
        self._serial = serial.Serial(path, baud, timeout=0, write_timeout=WRITE_S, exclusive=True)
        self._fd = self._serial.fileno()
        with contextlib.suppress(OSError):  # pyserial's own lock is one that others may overlook
            fcntl.ioctl(self._fd, termios.TIOCEXCL)
        with contextlib.suppress(OSError, ValueError, NotImplementedError, AttributeError):
            self._serial.set_low_latency_mode(True)  # else an FTDI chip keeps short answers for 16 ms
        self._serial.reset_input_buffer()  # what was said before belongs to nobody

    def read(self, timeout_s: float) -> bytes:
        """See `Wire`."""
        try:
            if not select.select([self._fd], [], [], max(timeout_s, 0.0))[0]:
                return b""
            data = self._serial.read(4096)
        except (OSError, ValueError, TypeError, serial.SerialException) as error:  # closed or torn out: pyserial raises any of these
            raise Unplugged(str(error)) from None
        if not data:
            raise Unplugged("end of file")
        return bytes(data)

    def write(self, data: bytes) -> None:
        """See `Wire`."""
        try:
            self._serial.write(data)
        except (OSError, ValueError, TypeError, serial.SerialException) as error:
            raise Unplugged(str(error)) from None

    def close(self) -> None:
        """See `Wire`."""
        if self._serial.is_open:  # once closed, its number may be that of another port
            with contextlib.suppress(OSError):
                fcntl.ioctl(self._fd, termios.TIOCNXCL)
        with contextlib.suppress(OSError, ValueError, TypeError, serial.SerialException):
            self._serial.close()


def open_port(path: str, baud: int, key: str) -> SerialWire:
    """The port, for us alone. Raises BadInput, naming `key`, where a person must act first; Unplugged where waiting may help."""
    try:
        return SerialWire(path, baud)
    except (OSError, serial.SerialException) as error:
        number = getattr(error, "errno", None)
        if number in (errno.EACCES, errno.EPERM):
            raise BadInput(
                f"{key}={path} was given, but you may not open it. Add yourself to the group of that file (often `dialout`), "
                f"log in again, or give another port."
            ) from None
        if number in (errno.EBUSY, errno.EAGAIN) or "exclusively lock" in str(error):
            raise BadInput(f"{key}={path} was given, but another program has it open. End that program, or give another port.") from None
        raise Unplugged(str(error)) from None


class DeviceLost(OioError):
    """A device stayed away for longer than it may."""
