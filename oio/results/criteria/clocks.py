"""Criteria of the clocks: do all readings arrive, are they stamped when they were taken, do gas and joints end together."""

from oio.core.settings import settings
from oio.results.calibration import MapCalibration, Navigation
from oio.results.criteria.judgement import Criterion, Measured, Results
from oio.runtime.gas_stream import StreamGaps


def _gaps(results: Results) -> StreamGaps | None:
    """Gaps of the gas samples up to the end of the search, or of the calibration."""
    last = results.get(Navigation) or results.get(MapCalibration)
    return last.gaps if isinstance(last, Navigation | MapCalibration) else None


@settings
class Clocks(Criterion):
    """Share of the gas readings that never came, by the sensor's own usual interval; a reading at the wrong time is at the wrong place."""

    def measure(self, results: Results) -> Measured | None:
        """Up to the end of the search, or of the calibration."""
        gaps = _gaps(results)
        if gaps is None:
            return None
        found = f"{gaps.missing} of {gaps.due} gas readings are missing, the longest silence is {gaps.longest_s:.1f} s"
        return Measured(
            100.0 * gaps.missing / max(gaps.due, 1), "%", found, above="Look at the cable, the baud rate and other programs on the port."
        )


@settings
class DelayKnown(Criterion):
    """Expanded uncertainty (k = 2) of the delay of gas stamps behind joint stamps, where calibration estimates it (nominal.delay_u_s above
    0), over the interval between two readings: a reading at the wrong time is at the wrong place."""

    def measure(self, results: Results) -> Measured | None:
        """None where the delay was told."""
        found = results.get(MapCalibration)
        if not isinstance(found, MapCalibration) or found.delay.u_s == 0.0 or found.gaps.interval_s == 0.0:
            return None
        late, interval_s = found.delay, found.gaps.interval_s
        return Measured(
            2.0 * late.u_s / interval_s, "intervals",
            f"readings are stamped {late.s:.2f} +- {2.0 * late.u_s:.2f} s (k = 2) late, and come every {interval_s:.2g} s",
            above="Make more repeats (stage.map_beliefs.repeats), or measure the latency and tell it (nominal.delay_s, delay_u_s=0).",
        )  # fmt: skip


@settings
class StreamEnds(Criterion):
    """Seconds by which one of both streams, gas and joints, stops before the other; one interval between readings is usual."""

    def measure(self, results: Results) -> Measured | None:
        """Up to the end of the search, or of the calibration; None without gas."""
        gaps = _gaps(results)
        if gaps is None or gaps.due == 0:
            return None
        apart_s = max(gaps.joints_after_s - gaps.interval_s, -gaps.joints_after_s, 0.0)
        gas_first = gaps.joints_after_s > 0.0
        first, second = ("gas", "joint") if gas_first else ("joint", "gas")
        said = (
            f"{first} stream stops {abs(gaps.joints_after_s):.1f} s before the {second} stream"
            if apart_s
            else "gas and joints end together"
        )
        look = "Look at the nose's cable, supply" if gas_first else "Look at the arm's cable, supply"
        return Measured(apart_s, "s", said, above=f"{look} and last messages in the log: what came after is not in the estimate.")
