"""Criterion of safety: was the arm held to limits, all of them, and did its commands keep them."""

import math

from oio.core.settings import settings
from oio.motion.guard_account import GuardAccount
from oio.results.calibration import MapCalibration, Navigation
from oio.results.criteria.judgement import Criterion, Measured, Results


@settings
class SafeMotion(Criterion):
    """Top speed of the nose, along the set-points that the guard gave, over its limit; infinite if a limit of joints, box or speed is not
    finite, or if a joint's load would never stop the arm."""

    def measure(self, results: Results) -> Measured | None:
        """Up to the end of the search, or of the calibration; None without an arm that moves."""
        last = results.get(Navigation) or results.get(MapCalibration)
        if not isinstance(last, Navigation | MapCalibration) or last.guard is None:
            return None
        guard, holes = last.guard, _holes(last.guard)
        if holes:
            return Measured(
                math.inf, "of the limit", holes, above="Do not let it move so: correct arm and safety, and look at the servos' loads."
            )
        share = guard.top_speed_m_s / guard.speed_limit_m_s
        return Measured(
            share, "of the limit",
            f"nose at {guard.top_speed_m_s:.2f} m/s at most, limit {guard.speed_limit_m_s:g}; every limit is finite, every load was heard",
            above="The guard did not keep its own limit: stop, and report it with the log.",
        )  # fmt: skip


def _holes(guard: GuardAccount) -> str:
    """What is missing, in words; empty if nothing is."""
    limits = f"no finite limit of {', '.join(guard.without_limit)}" if guard.without_limit else ""
    loads = f"no load that would stop {', '.join(guard.load_unwatched)}" if guard.load_unwatched else ""
    return " and ".join(hole for hole in (limits, loads) if hole)
