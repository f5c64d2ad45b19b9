"""How long a sensor will still settle: the slope of a first-order lag decays as exp(-t / tau)."""

import numpy as np

from oio.core.records import Array


def settling_time(t_s: Array, slopes: Array, allowed: float) -> float | None:
    """Seconds from the last time until the slope falls to `allowed`, by a line through ln |slope| of all times t_s (n,).

    0 if it has fallen so far already; None if fewer than three slopes are known, or if they do not decay by more than twice the standard
    error of that line's rate: what is extrapolated from less is any number.
    """
    magnitude = np.abs(slopes)
    if len(t_s) and magnitude[-1] <= allowed:
        return 0.0
    if len(t_s) < 3 or np.any(magnitude <= 0.0) or np.ptp(t_s) <= 0.0:
        return None
    t, logs = t_s - t_s[-1], np.log(magnitude)
    rate, level = np.polyfit(t, logs, 1)  # ln |slope| = level + rate t, rate = -1 / tau
    u_rate = np.sqrt(np.sum((logs - level - rate * t) ** 2) / (len(t) - 2) / np.sum((t - t.mean()) ** 2))
    return None if rate >= -2.0 * u_rate else float(max(0.0, (np.log(allowed) - level) / rate))
