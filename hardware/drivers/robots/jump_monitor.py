"""Monitor of what an arm cannot do: joints that jump."""

import math

import numpy as np

from oio.core.records import Array

FASTER = 2.0  # than it is led, at most: assumption


class JumpMonitor:
    """Finds a reading that is farther from the one before than joints move in that time, and than they may lag behind their set-points.

    `speed`: of the set-points [rad/s]; `slack_deg`: allowed besides.
    """

    def __init__(self, names: tuple[str, ...], speed: float, slack_deg: float) -> None:
        self._names, self._speed, self._slack_rad = names, speed, math.radians(slack_deg)
        self.restart()

    def restart(self) -> None:
        """The next reading is the first: the arm was away."""
        self._last: tuple[float, Array] | None = None

    def check(self, t_s: float, q: Array) -> str | None:
        """Return the jump of joints at q (n,) rad at t_s; None if there is none."""
        before, self._last = self._last, (t_s, q)
        if before is None:
            return None
        moved, most = np.abs(q - before[1]), self._slack_rad + FASTER * self._speed * max(t_s - before[0], 0.0)
        j = int(np.argmax(moved))
        if moved[j] <= most:
            return None
        jumped = f"joint {self._names[j]} jumped by {math.degrees(moved[j]):.0f} degrees within {1e3 * (t_s - before[0]):.0f} ms"
        return f"{jumped}, which no arm does that is led by {self._speed:g} rad/s: what reads it is wrong"
