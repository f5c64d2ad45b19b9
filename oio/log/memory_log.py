"""`MemoryLog`: in-memory log of a run that is scored and discarded. World samples are kept; nothing else is read back."""

from collections.abc import Iterator

from oio.core.records import Array, Belief, Event, FilterEstimate, GasReading, Innovation, WorldSample
from oio.log.entries import ArmFrames, BeliefScene, BelievedNose, Setup, StageMark
from oio.log.write import LONG_AGO_NS, Journal, RunLog


class MemoryLog(RunLog):
    """A `RunLog` without a file: `samples` returns the same record objects that were written, in the same order."""

    def __init__(self) -> None:
        self._stage, self._last_progress_ns, self._last_estimate_ns = "", LONG_AGO_NS, LONG_AGO_NS
        self._drawn_source, self.watchers = None, []
        self._kept: list[WorldSample] = []

    def write(self, sample: WorldSample) -> None:
        """Keep a world sample; progress events are never read back, so they are not kept."""
        if not (isinstance(sample, Event) and sample.kind == "progress"):
            self._kept.append(sample)
        self._tell(sample)

    def samples(self, since_ns: int = -1, until_ns: int | None = None) -> Iterator[WorldSample]:
        """Return the samples written so far with since_ns < t_ns <= until_ns, in that order."""
        written = tuple(self._kept)
        return (sample for sample in written if since_ns < sample.t_ns and (until_ns is None or sample.t_ns <= until_ns))

    def reading(self, reading: GasReading) -> None:
        """Derived from a sample: not kept."""
        self._tell(reading)

    def estimate(self, belief: Belief, names: tuple[str, ...], units: tuple[str, ...], every_s: float = 0.0) -> None:
        """Not kept."""

    def odometry(self, t_ns: int, nose_m: Array, cov: Array) -> None:
        """Not kept."""
        self._tell(BelievedNose(t_ns, nose_m, cov))

    def filter_estimate(self, estimate: FilterEstimate) -> None:
        """Not kept."""

    def innovation(self, innovation: Innovation) -> None:
        """Not kept."""
        self._tell(innovation)

    def spheres(self, t_ns: int, centres: Array, radii_m: Array, hypotheses: list[tuple[Array, Array]], text: str) -> None:
        """Not kept."""
        self._tell(BeliefScene(t_ns, centres, radii_m, hypotheses, text))

    @property
    def draws(self) -> bool:
        """Whether anybody watches."""
        return bool(self.watchers)

    def setup(self, setup: Setup) -> None:
        """Not kept."""
        self._tell(setup)

    def arm(self, frames: ArmFrames) -> None:
        """Not kept."""
        self._tell(frames)

    def attach(self, name: str, data: bytes) -> None:
        """Not kept."""

    def remember(self) -> None:
        """World samples are kept in any case."""

    def remembered(self) -> Journal:
        """Return the samples written so far."""
        return tuple(self._kept)

    def repeat(self, journal: Journal) -> None:
        """Keep the samples of another."""
        self._kept += journal

    def _mark(self, stage: str, state: str, t_ns: int, result: object, why: str = "") -> None:
        self._tell(StageMark(t_ns, stage, state, why))
