"""The paper's belief map, taken literally (II-D): a sphere per measurement, and the point where they meet, the "Voronoi vertex".

The RSSI of what is read at rest gives the radius. No lag, drift or fluctuation is modelled. The strength is as told
(`range_law.ln_strength`), else it is solved for, with one sphere more. The paper gives the vertex no covariance; here it is that of the
ranges: the mean square of |centre - vertex| - radius on every axis.
"""

from typing import Annotated

import numpy as np

from oio.core.errors import NotObservable
from oio.core.records import Array
from oio.core.settings import Within, settings
from oio.gas.range_law import EXPONENT, LN_STRENGTH, SOURCE
from oio.gas.rssi import Rssi
from oio.gas.trace import STILL_RAD, Sniffs, Trace
from oio.inference.map_fit import Fit
from oio.inference.prior import Prior
from oio.inference.trilateration import vertex, vertex_unknown_strength


@settings
class SphereMap:
    """Settings of the spheres."""

    path_period_s: Annotated[float, Within(0.01, 60)]
    limit: Annotated[int, Within(100, 10_000_000)]
    detection_sigmas: Annotated[float, Within(0, 1e6)]  # a measurement below so many standard deviations of a reading gives no sphere

    def trace(self) -> Trace:
        """Return an empty trace."""
        return Trace(self.path_period_s, self.limit)

    @property
    def as_calibrated(self) -> "SphereMap":
        """The map itself: it knows of no other world."""
        return self

    def locate(self, sniffs: Sniffs, known: Prior, before: tuple[Fit, ...] = (), thorough: bool = True) -> tuple[Fit, ...]:
        """Return the vertex, or the centre of the workspace box, with its variance, while the spheres determine none."""
        centres, levels = self._measurements(sniffs, known)
        lagged_ppm = float(levels[-1]) if len(levels) else 0.0
        try:
            mean, cov = self._vertex(centres, levels, known)
        except NotObservable:  # too few spheres, or all in a plane: an answer all the same, and as wide as the box
            mean, cov = known.mean, known.cov
        return (Fit(known.layout, mean, cov, 0.0, lagged_ppm, known.model.fluctuation, len(sniffs.ppm), known.model.law),)

    def _vertex(self, centres: Array, levels: Array, known: Prior) -> tuple[Array, Array]:
        """theta (P,) and its covariance with the source at the vertex of spheres about (k, 3) m with levels (k,) ppm; raises
        NotObservable."""
        law, mean, cov, exponent = known.model.law, np.array(known.mean), np.array(known.cov), float(known.mean[EXPONENT])
        if law.ln_strength is None:
            point = vertex_unknown_strength(centres, levels ** (-1.0 / exponent))
            r = np.maximum(np.linalg.norm(centres - point, axis=1), law.radius_m)
            mean[LN_STRENGTH] = float(np.median(np.log(levels) + exponent * np.log(r / law.r_ref_m)))
        else:
            mean[LN_STRENGTH] = law.ln_strength
        rssi = Rssi(1.0, law.r_ref_m, 10.0 * float(mean[LN_STRENGTH]) / np.log(10.0), exponent)
        radii = rssi.range_m(rssi.of(levels))
        point = vertex(centres, radii) if law.ln_strength is not None else point
        misfit = np.linalg.norm(centres - point, axis=1) - radii
        cov[SOURCE, :] = cov[:, SOURCE] = 0.0
        mean[SOURCE], cov[SOURCE, SOURCE] = point, float(np.mean(misfit**2)) * np.eye(3)
        return mean, cov

    def _measurements(self, sniffs: Sniffs, known: Prior) -> tuple[Array, Array]:
        """Nose (k, 3) m and concentration (k,) ppm of every rest of the arm: the last third of its readings, after the lag."""
        lay, theta = known.layout, known.mean
        c = (sniffs.ppm - theta[lay.baseline][sniffs.element]) / np.exp(theta[lay.gain])[sniffs.element]
        q = sniffs.q[sniffs.at]
        begins = np.flatnonzero(np.any(np.abs(np.diff(q, axis=0)) > STILL_RAD, axis=1)) + 1
        ends = [part[-max(len(part) // 3, 1) :] for part in np.split(np.arange(len(c)), begins)]
        levels = np.array([np.mean(c[end]) for end in ends])
        centres = known.model.arm.nose(q[[end[-1] for end in ends]])
        detected = levels > self.detection_sigmas * float(np.median(sniffs.sigma_ppm))
        return centres[detected], levels[detected]
