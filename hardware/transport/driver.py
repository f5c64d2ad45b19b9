"""The protocol of a device driver, and how long to wait for a device."""

from collections import Counter
from typing import Annotated, Protocol, TypeVar

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


class Connection(Protocol):
    """Protocol of what a driver speaks over: an open port, or another program's arm."""

    def close(self) -> None:
        """Close it; never raises."""
        ...


C = TypeVar("C", bound=Connection)
C_contra = TypeVar("C_contra", contravariant=True)


class Driver(Protocol[C_contra]):
    """Protocol of a device driver over connections C. Every method raises Unplugged when they are gone and NoAnswer on a time-out."""

    key: str  # config key: backend.nose
    name: str  # value of KEY.driver=

    def configure(self, connection: C_contra, /) -> str | None:
        """Configure the device; return what it says of itself. Called each time the connection was opened."""
        ...

    def poll(self, connection: C_contra, /) -> bool:
        """Do one polling cycle and put its samples into the mailbox; return whether the device answered."""
        ...

    def release(self, connection: C_contra, /) -> None:
        """Put the device into its final state, before the connection is closed."""
        ...

    def counts(self) -> Counts:
        """Link statistics so far: frames good, corrupt, lost, late, bytes skipped, and whatever else the driver counts."""
        ...


class SerialDriver(Driver[Wire], Protocol):
    """Protocol of the driver of a device at a serial port."""

    baud: int

    def identify(self, wire: Wire) -> str | None:
        """Return a description of the device if it is of this driver's kind, else None."""
        ...
