"""How long a sensor will still settle: the slope of a first-order lag decays as exp(-t / tau)."""

import numpy as np

from oio.core.records import Array


def settling_time(t_s: Array, slopes: Array, allowed: float) -> float | None:
    """Seconds from the last time until the slope falls to `allowed`, by a line through ln |slope| of all times t_s (n,).

    0 if it has fallen so far already; None if fewer than three slopes are known, or if they do not decay.
    """
    magnitude = np.abs(slopes)
    if len(t_s) and magnitude[-1] <= allowed:
        return 0.0
    if len(t_s) < 3 or np.any(magnitude <= 0.0) or np.ptp(t_s) <= 0.0:
        return None
    rate, level = np.polyfit(t_s - t_s[-1], np.log(magnitude), 1)  # ln |slope| = level + rate t, rate = -1 / tau
    return None if rate >= 0.0 else float(max(0.0, (np.log(allowed) - level) / rate))
