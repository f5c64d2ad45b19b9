"""Protocol of a belief map: from the trace of a search to hypotheses for the source."""

from typing import Protocol, Self, runtime_checkable

from oio.gas.trace import Sniffs, Trace
from oio.inference.map_fit import Fit
from oio.inference.prior import Prior


@runtime_checkable
class Localizer(Protocol):
    """Belief map, immutable: it gets the whole trace each time."""

    def trace(self) -> Trace:
        """Return an empty trace."""
        ...

    @property
    def as_calibrated(self) -> Self:
        """The same map without alternatives to the calibrated world."""
        ...

    def locate(self, sniffs: Sniffs, known: Prior, before: tuple[Fit, ...] = (), thorough: bool = True) -> tuple[Fit, ...]:
        """Return hypotheses for the source, best first, each with its covariance; at least one.

        `before`: those of the last map. `thorough`: alternatives to the calibrated world are looked at, too.
        """
        ...
