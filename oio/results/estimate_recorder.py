"""What filters believed over time while they were run over a log again: nose and source, at every map and at a rate between."""

from dataclasses import dataclass, field

from oio.core.records import FilterEstimate, nanoseconds
from oio.estimators.odometry import Odometry


@dataclass(slots=True)
class EstimateRecorder:
    """Keeps the estimates of the variants `names`, none less than `every_s` after the last of the same variant, except those of maps."""

    names: tuple[str, ...] = ()
    every_s: float = 0.0
    estimates: list[FilterEstimate] = field(default_factory=list)
    _next_ns: dict[str, int] = field(default_factory=dict)

    def add(self, t_ns: int, name: str, odometry: Odometry, mapped: bool = False) -> None:
        """Keep an estimate at the time of the latest joints if one is due, or after a map; there is none before the first map."""
        if name not in self.names or not (mapped or t_ns >= self._next_ns.get(name, t_ns)):
            return
        nose, source = odometry.nose(), odometry.source()
        if nose is not None and source is not None:
            self.estimates.append(FilterEstimate(t_ns, name, *nose, *source))
            self._next_ns[name] = t_ns + nanoseconds(self.every_s)
