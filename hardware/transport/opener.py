"""How a device is reached: by a serial port, or by whatever else a driver brings an `Opener` for."""

from typing import Protocol, TypeVar

from hardware.transport.discovery import resolve_port
from hardware.transport.driver import SerialDriver
from hardware.transport.port import Wire, open_port

C_co = TypeVar("C_co", covariant=True)


class Opener(Protocol[C_co]):
    """Protocol of the way to a device."""

    port: str  # as it was typed
    advice: str  # a sentence: what to look at if nothing answers

    @property
    def call_s(self) -> float:
        """Duration of the present call into code of others, which may never return [s]; 0 where every call has a time-out of ours."""
        ...

    def open(self) -> C_co:
        """Open a connection. Raises OioError where the user must act, Unplugged or NoAnswer where waiting may help."""
        ...


class SerialOpener:
    """Opener of a serial port."""

    advice = "Check cable, power and driver; `python -m hardware.ports` asks every port who it is."
    call_s = 0.0

    def __init__(self, port: str, driver: SerialDriver) -> None:
        self.port, self._driver = port, driver

    def open(self) -> Wire:
        """Find the port and open it alone."""
        key = f"{self._driver.key}.port"
        return open_port(resolve_port(self.port, key, self._driver.baud, self._driver.identify), self._driver.baud, key)
