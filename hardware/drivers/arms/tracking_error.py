"""Tracking error monitor of a servo arm."""

import math

import numpy as np

from oio.core.records import Array


class TrackingErrorMonitor:
    """Detector of a lasting tracking error: an obstacle in a joint's way, or a stuck encoder."""

    def __init__(self, names: tuple[str, ...], most_deg: float, for_s: float) -> None:
        self._names, self._most_rad, self._for_s = names, math.radians(most_deg), for_s
        self._since_s = np.full(len(names), np.nan)  # start of each joint's tracking error; NaN if it has none

    def check(self, t_s: float, q_rad: Array, led_rad: Array) -> str | None:
        """Return the fault of joints at q_rad (n,) with set-points led_rad (n,) at t_s; None while no error has lasted long enough."""
        off = np.abs(q_rad - led_rad) > self._most_rad
        self._since_s = np.where(off, np.fmin(self._since_s, t_s), np.nan)
        longest = np.nan_to_num(t_s - self._since_s, nan=0.0)
        j = int(np.argmax(longest))
        if longest[j] <= self._for_s:
            return None
        off_deg = math.degrees(abs(float(q_rad[j] - led_rad[j])))
        return f"joint {self._names[j]} is {off_deg:.0f} degrees from where it was led; something is in its way, or its encoder is stuck"
