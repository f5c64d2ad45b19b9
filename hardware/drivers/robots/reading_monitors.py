"""Monitors of what an arm cannot do: joints that jump, and joints that are led and say the same to the last digit."""

import math

import numpy as np

from oio.core.records import Array

FASTER = 2.0  # than it is led, at most: assumption
STALE_DEG = 2.0  # an arm that is led so far says something else to the last digit: assumption


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


class StaleMonitor:
    """Finds readings that stay the same, of all joints and to the last digit, while the arm is led elsewhere; `for_s`: for so long."""

    def __init__(self, for_s: float) -> None:
        self._for_s, self._most_rad = for_s, math.radians(STALE_DEG)
        self.restart()

    def restart(self) -> None:
        """The next reading is the first: the arm was away."""
        self._since: tuple[float, Array, Array] | None = None  # time, joints and set-point when the joints last said something else

    def check(self, t_s: float, q: Array, led: Array) -> str | None:
        """Return the fault of joints at q (n,) rad with set-points led (n,) rad at t_s; None if there is none."""
        if self._since is None or not np.array_equal(q, self._since[1]):
            self._since = (t_s, q, led)
        since_s, _, led_then = self._since
        led_rad = float(np.max(np.abs(led - led_then)))
        if t_s - since_s <= self._for_s or led_rad <= self._most_rad:
            return None
        return (
            f"the joints have said the same for {t_s - since_s:.1f} s, to the last digit, while they were led by "
            f"{math.degrees(led_rad):.0f} degrees: what reads them is stale, or the arm takes no set-points"
        )
