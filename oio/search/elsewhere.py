"""Look elsewhere before a declaration: another source, as strong as the one that was found, may be where nobody would have smelt it.

A source at s would have shown at a sniff if its concentration there, by the believed law, had exceeded the threshold of a whiff and that of
the source that was found. The next sniff is the one at which the most places that have not been tested yet would show: with a uniform prior
over the workspace box that is the greatest expected Bayes factor between one source and two.
"""

from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from oio.core.records import Array
from oio.core.settings import Within, settings
from oio.gas.range_law import LAW, SOURCE, concentration
from oio.inference.sampling import halton
from oio.search.d_optimal import path_is_clear, sd_m
from oio.search.view import View

PLACES = 96  # of the other source, spread over the workspace box
POSES = 128  # candidate sniffs


@settings
class LookElsewhere:
    """Settings of the look elsewhere; it costs a few moves in wind, where plumes are narrow, and next to none in still air."""

    below_sd_m: Annotated[float, Within(0, 100)]  # it begins when the root of the trace of the source's covariance is below this,
    covered: Annotated[float, Within(0, 1)]  # and ends when this share of the workspace box would have shown a source as strong,
    least_gain: Annotated[float, Within(1e-6, 1)]  # or when no sniff adds at least so much to it
    sniffs: Annotated[int, Within(1, 1000)]  # a place is tested by so many sniffs at which its source would have shown:
    whiff_sigmas: Annotated[float, Within(0, 1e6)]  # above this many standard deviations of a reading
    contrast: Annotated[float, Within(0, 1e3)]  # plus this much of the concentration of the source that was found

    def propose(self, view: View, rng: np.random.Generator) -> Array | None:
        """Return a pose (n,) rad at which another source may show; None if enough was tested, or the belief is not narrow yet."""
        if view.belief is None or view.arm.dof < 3 or sd_m(view) > self.below_sd_m:
            return None
        low, high = np.array(view.arm.box_low_m), np.array(view.arm.box_high_m)
        places = low + halton(PLACES) * (high - low)
        tested = np.count_nonzero(self._would_show(view, np.array([move.q for move in view.moves]), places), axis=0) >= self.sniffs
        if np.mean(tested) >= self.covered:
            return None
        poses = view.arm.random_poses(rng, POSES)
        poses = poses[path_is_clear(view, poses)]
        gain = np.count_nonzero(self._would_show(view, poses, places[~tested]), axis=1) / PLACES
        if not len(poses) or np.max(gain) < self.least_gain:
            return None
        q_now = view.moves[-1].q if view.moves else view.arm.home
        return np.asarray(poses[int(np.argmax(gain / (view.arm.duration_s(q_now, poses) + view.dwell_s)))])

    def _would_show(self, view: View, q: Array, places_m: Array) -> NDArray[np.bool_]:
        """Whether a source at places (j, 3) m would show at joints q (k, n): (k, j)."""
        assert view.belief is not None
        model, x = view.model, view.belief.mean
        at = model.at
        law, noses = np.array(x[at["s"].start : at["s"].start + LAW]), model.arm.nose(q - x[at["o"]])
        found = concentration(noses, law, model.law.r_ref_m, model.law.radius_m)[0]
        threshold = self.whiff_sigmas * model.sigma_ppm + self.contrast * found
        show = np.empty((len(q), len(places_m)), dtype=np.bool_)
        for j, place in enumerate(places_m):
            law[SOURCE] = place
            show[:, j] = concentration(noses, law, model.law.r_ref_m, model.law.radius_m)[0] > threshold
        return show
