"""Gradient search (chemotaxis): a local plane fitted to ln of the latest signals, and a step up its slope.

ln c = a + g . (p - p_best), weighted by distance from the best of the latest sniffs; the next sniff is one step from there along g. A
direction in which the sniffs hardly differ is probed first. The step shrinks with every move without gain and grows with every gain, as
in stochastic hill climbing (Rastrigin 1963) and much as bacteria do by chemotaxis (Berg 1975).
"""

from typing import Annotated

import numpy as np

from oio.core.records import Array
from oio.core.settings import Within, refuse_below, settings
from oio.search.sniff_history import sniff_history
from oio.search.step_planning import box_diagonal_m, step_toward, tangent_directions
from oio.search.view import View


@settings
class Gradient:
    """Gradient ascent strategy; lengths are fractions of the diagonal of the nose's workspace box."""

    fit_sniffs: Annotated[int, Within(4, 1000)]  # number of latest sniffs in the fit; the best one of them is the base point
    step: Annotated[float, Within(1e-4, 1)]  # largest step
    min_step: Annotated[float, Within(1e-4, 1)]  # smallest step
    step_factor: Annotated[float, Within(0.1, 1)]  # factor on the step after a move without gain; a gain divides by it
    spread: Annotated[float, Within(0, 1)]  # in steps: a direction in which the sniffs spread less (RMS) is probed

    def check(self) -> None:
        """Raise BadInput for a first step below the shortest."""
        refuse_below(self, "step", "min_step")

    def propose(self, view: View, rng: np.random.Generator) -> Array:
        """Return the next joint goal (n,) rad."""
        history = sniff_history(view)
        if len(history.ppm) == 0:
            return self._probe(view, rng)
        y = np.log(np.maximum(history.ppm, view.model.sigma_ppm))[-self.fit_sniffs :]
        best, step = self.climbed(y)
        p, step_m = history.p_m[-self.fit_sniffs :], step * box_diagonal_m(view)
        tangents = tangent_directions(view, history.q[-self.fit_sniffs :][best])
        direction = self.direction((p - p[best]) @ tangents / step_m, y, rng)
        return step_toward(view, p[best] + step_m * (tangents @ direction), rng)

    def climbed(self, y: Array) -> tuple[int, float]:
        """Return the index of the best of ln signals y (k,) in order of time, and the adapted step after them."""
        return climbed(y, self.step, self.min_step, self.step_factor)

    def direction(self, x: Array, y: Array, rng: np.random.Generator) -> Array:
        """Return the unit vector (r,) up the plane through ln signals y (k,) at x (k, r) steps from the best; a probe without a slope."""
        weight = np.exp(-0.125 * np.sum(x * x, axis=1))  # a sniff two steps away has weight 0.6
        spread, axes = np.linalg.eigh((weight * x.T) @ x / np.sum(weight))
        root, rows = np.sqrt(weight), np.column_stack([np.ones(len(y)), x])
        slope = np.linalg.lstsq(root[:, None] * rows, root * y, rcond=None)[0][1:]
        steepness = float(np.linalg.norm(slope))
        if spread[0] < self.spread**2 or steepness < 1e-9:
            return np.asarray(axes[:, 0] * rng.choice([-1.0, 1.0]))
        return np.asarray(slope / steepness)

    def _probe(self, view: View, rng: np.random.Generator) -> Array:
        """First step, from home in a random direction."""
        tangents = tangent_directions(view, view.arm.home)
        direction = rng.standard_normal(tangents.shape[1])
        step = self.step * box_diagonal_m(view) / np.linalg.norm(direction)
        return step_toward(view, view.arm.nose(view.arm.home) + step * (tangents @ direction), rng)


def climbed(y: Array, step: float, min_step: float, factor: float) -> tuple[int, float]:
    """Return the index of the best of ln signals y (k,) in order of time, and the step after them: `factor` times it after a move without
    gain, over it after a gain, within its bounds."""
    best, adapted = 0, step
    for i in range(1, len(y)):
        gain = y[i] > y[best]
        best, adapted = (i, adapted / factor) if gain else (best, adapted * factor)
        adapted = min(max(adapted, min_step), step)
    return best, adapted
