"""What a bout rule must offer: the choice `bout=NAME`, and its live detector."""

from typing import Protocol, runtime_checkable

from oio.core.records import GasReading
from oio.gas.bouts import Bout, ElementBaseline


class Detector(Protocol):
    """A live bout rule: it is fed one reading at a time."""

    def feed(self, reading: GasReading) -> Bout | None:
        """Process one reading; None until there is enough of them."""
        ...


@runtime_checkable
class DetectionRule(Protocol):
    """The choice `bout=NAME`: what counts as a bout."""

    def window(self, dof: int) -> int:
        """Return the window k of the moving average for `dof` joints; raises BadInput if none is configured."""
        ...

    def detector(self, k: int, baselines: tuple[ElementBaseline, ...]) -> Detector:
        """Make it live, for the clean-air baselines of the elements."""
        ...
