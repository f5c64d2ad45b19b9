"""Serial port as the drivers use it: read, write, and `Unplugged` when it is gone; opened for exclusive access."""

import contextlib
import errno
import fcntl
import select
import termios
from typing import Protocol

import serial

from oio.core.errors import BadInput, OioError

WRITE_S = 2.0  # a port that accepts no bytes for this long counts as gone


class Unplugged(Exception):
    """The port is gone, or the device behind it does not answer any more; it may come back."""


class NoAnswer(Exception):
    """A device did not answer within its time-out."""


class Wire(Protocol):
    """Protocol of an open port."""

    def read(self, timeout_s: float) -> bytes:
        """Return the bytes received; waits up to timeout_s for the first one, b"" on a time-out. Raises Unplugged."""
        ...

    def write(self, data: bytes) -> None:
        """Write all bytes. Raises Unplugged."""
        ...

    def close(self) -> None:
        """Close the port; never raises."""
        ...


class SerialWire:
    """Open serial port over pyserial."""

    def __init__(self, path: str, baud: int) -> None:
        self._serial = serial.Serial(path, baud, timeout=0, write_timeout=WRITE_S, exclusive=True)
        self._fd = self._serial.fileno()
        with contextlib.suppress(OSError):  # pyserial's own lock is advisory: other programs may ignore it
            fcntl.ioctl(self._fd, termios.TIOCEXCL)
        with contextlib.suppress(OSError, ValueError, NotImplementedError, AttributeError):
            self._serial.set_low_latency_mode(True)  # else an FTDI chip buffers short answers for 16 ms
        self._serial.reset_input_buffer()  # discard stale bytes from before the opening

    def read(self, timeout_s: float) -> bytes:
        """See `Wire`."""
        try:
            if not select.select([self._fd], [], [], max(timeout_s, 0.0))[0]:
                return b""
            data = self._serial.read(4096)
        except (OSError, ValueError, TypeError, serial.SerialException) as error:  # closed or unplugged: pyserial raises any of these
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
        if self._serial.is_open:  # after closing, its descriptor may belong to another port
            with contextlib.suppress(OSError):
                fcntl.ioctl(self._fd, termios.TIOCNXCL)
        with contextlib.suppress(OSError, ValueError, TypeError, serial.SerialException):
            self._serial.close()


def open_port(path: str, baud: int, key: str) -> SerialWire:
    """Open a port for exclusive access. Raises BadInput, naming `key`, where the user must act; Unplugged where waiting may help."""
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
    """A device was away for longer than its time-out."""
