"""The protocol of a device driver, and how long to wait for a device."""

from collections import Counter
from typing import Annotated, Protocol

from hardware.transport.port import Wire
from oio.core.settings import Within, settings

Counts = Counter[str]


@settings
class Timeouts:
    """Time-outs and back-off of a device connection [s]."""

    connect_s: Annotated[float, Within(0.1, 600)]  # until the first answer, when the world opens
    receive_s: Annotated[float, Within(0.05, 600)]  # without an answer, after which the port is reopened
    reconnect_s: Annotated[float, Within(0, 3600)]  # without an answer, after which the run ends
    backoff_s: Annotated[float, Within(0.01, 10)]  # before the first retry; doubled before each further one,
    backoff_max_s: Annotated[float, Within(0.01, 60)]  # up to this maximum


class Driver(Protocol):
    """Protocol of a device driver. Every method raises Unplugged when the port is gone and NoAnswer on a time-out of the device."""

    key: str  # config key: backend.nose
    name: str  # value of KEY.driver=
    baud: int

    def identify(self, wire: Wire) -> str | None:
        """Return a description of the device if it is of this driver's kind, else None."""
        ...

    def configure(self, wire: Wire) -> str | None:
        """Configure the device; return what it says of itself, as `identify`. Called each time the port was opened."""
        ...

    def poll(self, wire: Wire) -> bool:
        """Do one polling cycle and put its samples into the mailbox; return whether the device answered."""
        ...

    def release(self, wire: Wire) -> None:
        """Put the device into its final state, before the port is closed."""
        ...

    def counts(self) -> Counts:
        """Link statistics so far: frames good, corrupt, lost, late, bytes skipped, and whatever else the driver counts."""
        ...
