"""Climbs the signal: a local plane through ln of the latest signals, and a step up its slope.

ln c = a + g . (p - p_best), weighted by distance from the best of the latest sniffs; the next sniff is one step from there along g. A
direction in which the sniffs hardly differ is probed first. The step shrinks with every move without gain and grows with every gain, as
in stochastic hill climbing (Rastrigin 1963) and much as bacteria do by chemotaxis (Berg 1975).
"""

import numpy as np

from oio.core.records import Array
from oio.core.settings import in_range, settings
from oio.search.sniff_history import sniff_history
from oio.search.step_planning import box_diagonal_m, step_toward, tangent_directions
from oio.search.view import View


@settings
class Gradient:
    """Lengths are fractions of the diagonal of the nose's box."""

    latest: int  # sniffs that count: the best one of them is climbed from
    step: float  # the longest step
    least: float  # and the shortest
    shrink: float  # of the step after a move without gain; a gain undoes one shrinking
    spread: float  # in steps: a direction is probed if the sniffs differ less than this in it (RMS)

    def check(self) -> None:
        """Refuse senseless steps; a plane in space needs four sniffs."""
        in_range(self, latest=(4, 1000), least=(1e-4, 1.0), step=(self.least, 1.0), shrink=(0.1, 1.0), spread=(0.0, 1.0))

    def propose(self, view: View, rng: np.random.Generator) -> Array:
        """The next joint goal (n,) rad."""
        seen = sniff_history(view)
        if len(seen.ppm) == 0:
            return self._probe(view, rng)
        y = np.log(np.maximum(seen.ppm, view.model.sigma_ppm))[-self.latest :]
        best, step = self.climbed(y)
        p, step_m = seen.p_m[-self.latest :], step * box_diagonal_m(view)
        can = tangent_directions(view, seen.q[-self.latest :][best])
        direction = self.direction((p - p[best]) @ can / step_m, y, rng)
        return step_toward(view, p[best] + step_m * (can @ direction), rng)

    def climbed(self, y: Array) -> tuple[int, float]:
        """Which of ln signals y (k,) in order of time is the best, and the step after them."""
        best, step = 0, self.step
        for i in range(1, len(y)):
            gain = y[i] > y[best]
            best, step = (i, step / self.shrink) if gain else (best, step * self.shrink)
            step = min(max(step, self.least), self.step)
        return best, step

    def direction(self, x: Array, y: Array, rng: np.random.Generator) -> Array:
        """Unit vector (r,) up the plane through ln signals y (k,) at x (k, r) steps from the best; a probe if it has no slope."""
        weight = np.exp(-0.125 * np.sum(x * x, axis=1))  # two steps away a sniff counts for 0.6
        spread, axes = np.linalg.eigh((weight * x.T) @ x / np.sum(weight))
        root, rows = np.sqrt(weight), np.column_stack([np.ones(len(y)), x])
        slope = np.linalg.lstsq(root[:, None] * rows, root * y, rcond=None)[0][1:]
        steep = float(np.linalg.norm(slope))
        if spread[0] < self.spread**2 or steep < 1e-9:
            return np.asarray(axes[:, 0] * rng.choice([-1.0, 1.0]))
        return np.asarray(slope / steep)

    def _probe(self, view: View, rng: np.random.Generator) -> Array:
        """A first step from home in a random direction."""
        can = tangent_directions(view, view.arm.home)
        direction = rng.standard_normal(can.shape[1])
        step = self.step * box_diagonal_m(view) / np.linalg.norm(direction)
        return step_toward(view, view.arm.nose(view.arm.home) + step * (can @ direction), rng)
