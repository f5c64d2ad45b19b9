"""Range law: RSSI and range of a response, and the filter's model of the mean concentration around a source.

ln c(p) = l - n ln(r / r_ref) - (|k| r - k.d) - u r,   d = p - s,   r^2 = |d|^2 + radius^2

n = 1, k = 0 is diffusion from a point source, any n with k = 0 log-distance path loss as in radio (Rappaport), and k = U / 2K the steady
advection-diffusion plume of a source in wind U with eddy diffusivity K. u is the thinning (decay with distance) of a plume that is still
growing or is lost to the room (1 / u is the length of the isotropic plume of Vergassola et al. 2007). l, the ln source strength, is the
logarithm of the concentration at r_ref. The radius of the source removes the singularity.
"""

from dataclasses import replace
from typing import Annotated

import numpy as np

from oio.core.compiled import compiled
from oio.core.errors import BadInput
from oio.core.records import Array
from oio.core.settings import Within, settings
from oio.gas.fluctuation import MeanField

FORMS = ("evidence", "log_distance", "isotropic", "advection_diffusion", "all")
LAW = 9  # parameters of the law, theta = (s (3) m, l, n, k (3) 1/m, u 1/m), and their indices:
SOURCE, LN_STRENGTH, EXPONENT, WIND, THINNING = slice(0, 3), 3, 4, slice(5, 8), 8
SX, SY, SZ, KX, KY, KZ = 0, 1, 2, 5, 6, 7
MAX_NOSE_JITTER_M, MAX_DISCREPANCY = 1.0, 5.0  # a discrepancy of e^5 per e-fold of distance makes the law uninformative already
UNKNOWN_STRENGTH_U = 2.0  # standard uncertainty of l about the largest reading (a factor of seven), if not configured
MIN_LN_PPM, MAX_LN_PPM = -20.0, 14.0  # allowed range of a configured ln_strength; ln(1e6 ppm) is 13.8
_SMOOTH_PER_M = 0.5  # |k| is smoothed below this, so that it is differentiable in still air (k = 0)
MAX_LN_C = 50.0  # clip of ln c: exp does not overflow
LEAST_PPM = 1e-300  # of one of several fields that add up: their shares exist where none of them is left
_MAX_LN_RARITY = np.log(1000.0)  # clip of the rarity: far off the axis, puffs do not become rarer without bound as the law has it


@settings
class RangeLaw:
    """Nominal range law before calibration, and the standard uncertainties of its parameters."""

    form: str  # which of n, k and u the calibration estimates: one of FORMS
    r_ref_m: Annotated[float, Within(1e-3, 100)]  # reference distance, at which l is defined
    radius_m: Annotated[float, Within(1e-4, 1)]  # radius of the source
    # ln_strength: l of the source to be found, if known; None: its prior is centred on the largest reading
    ln_strength: Annotated[float | None, Within(MIN_LN_PPM, MAX_LN_PPM, "natural logarithm of ppm (3 is 20 ppm)")]
    ln_strength_u: Annotated[float, Within(1e-3, 20)]  # of l, in either case
    exponent: Annotated[float, Within(0.1, 6)]  # n
    exponent_u: Annotated[float, Within(1e-6, 5)]
    wind_per_m_u: Annotated[float, Within(1e-6, 1e3)]  # of each horizontal component of k = U / 2K; the mean is still air
    lift_per_m_u: Annotated[float, Within(1e-6, 1e3)]  # of its vertical component
    thinning_per_m_u: Annotated[float, Within(1e-6, 1e3)]  # of u; the mean is 0
    # nose_jitter_m: short-term uncertainty of the nose position (backlash), until calibrated
    nose_jitter_m: Annotated[float, Within(1e-6, MAX_NOSE_JITTER_M)]
    # nose_jitter_choices_m: candidates, of which calibration takes the likeliest
    nose_jitter_choices_m: Annotated[tuple[float, ...], Within(1e-6, MAX_NOSE_JITTER_M)]
    # model_discrepancy: of a real plume from the law, in ln C per e-fold of distance from r_ref, until calibrated
    model_discrepancy: Annotated[float, Within(0, MAX_DISCREPANCY)]
    model_discrepancy_choices: Annotated[tuple[float, ...], Within(0, MAX_DISCREPANCY)]  # likewise
    typical_nose_jitter_m: Annotated[float, Within(0, MAX_NOSE_JITTER_M)]  # a candidate below this,
    typical_model_discrepancy: Annotated[float, Within(0, MAX_DISCREPANCY)]  # or below this,
    # calm_min_evidence: must be likelier by this in -2 ln L (Kass & Raftery 1995: above 10 the evidence is very strong)
    calm_min_evidence: Annotated[float, Within(0, 1e6)]
    fluctuation_intensity: Annotated[float, Within(1e-3, 10)]  # relative concentration fluctuation gamma on the plume's axis
    eddy_s: Annotated[float, Within(1e-3, 1e3)]  # its correlation time at r_ref

    def check(self) -> None:
        """Raise BadInput for an unknown form, or for no candidates."""
        if self.form not in FORMS:
            raise BadInput(
                f"range_law.form is '{self.form}', but it can be {', '.join(FORMS[:-1])} or {FORMS[-1]}. Type range_law.form=all."
            )
        for key in ("nose_jitter_choices_m", "model_discrepancy_choices"):
            if not getattr(self, key):
                raise BadInput(f"range_law.{key} is [], but it takes one or more. Type e.g. range_law.{key}=[0.1].")

    def strength(self, largest_ppm: float) -> float:
        """Return the prior mean of l: as configured, or at the largest reading."""
        return float(np.log(largest_ppm)) if self.ln_strength is None else self.ln_strength

    def with_unknown_strength(self) -> "RangeLaw":
        """Return the law for another source, such as the beacon, whose strength is not configured."""
        return self if self.ln_strength is None else replace(self, ln_strength=None, ln_strength_u=UNKNOWN_STRENGTH_U)

    def calm_penalty(self, nose_jitter_m: float, model_discrepancy: float) -> float:
        """Return the penalty, in -2 ln L, on a nose jitter or model discrepancy below its typical value."""
        return self.calm_min_evidence * (
            (nose_jitter_m < self.typical_nose_jitter_m) + (model_discrepancy < self.typical_model_discrepancy)
        )

    def field(self, c: Array, rarity: Array, r: Array, speed_m_s: Array, exponent: float, by_wind_m: Array) -> MeanField:
        """Return the mean field in the form that the fluctuation model takes."""
        return MeanField(c, rarity, r, speed_m_s, exponent * self.nose_jitter_m, self.model_discrepancy, self.r_ref_m, by_wind_m)


@compiled
def concentration(p: Array, theta: Array, r_ref: float, radius: float) -> tuple[Array, Array, Array, Array]:
    """Mean concentration c (k,) [ppm] at p (k, 3) [m], the derivative of ln c (k, LAW) by theta = (s (3), l, n, k (3), u), the
    distance r (k,) [m] and the rarity exp(|k| r - k.d) (k,), at most 1000.

    The derivative by p is minus that by s.
    """
    k, law = p.shape[0], theta.copy()  # that of a belief is read-only, and would be compiled for itself
    c, grad, distance, rarity = np.empty(k), np.empty((k, LAW)), np.empty(k), np.empty(k)
    for i in range(k):
        c[i], distance[i], rarity[i] = concentration_at(
            p[i, 0] - law[SX], p[i, 1] - law[SY], p[i, 2] - law[SZ], law, r_ref, radius, grad[i]
        )
    return c, grad, distance, rarity


@compiled
def concentration_at(dx: float, dy: float, dz: float, theta: Array, r_ref: float, radius: float, grad: Array) -> tuple[float, float, float]:
    """c, r and rarity of `concentration` at one displacement d from the source; writes the derivative of ln c to grad (>= LAW,)."""
    kx, ky, kz = theta[KX], theta[KY], theta[KZ]
    k_norm = np.sqrt(kx * kx + ky * ky + kz * kz + _SMOOTH_PER_M**2)
    ln_c, r2, ln_r, off_axis = log_concentration(dx, dy, dz, theta, r_ref, radius)
    r = np.sqrt(r2)
    radial = theta[EXPONENT] / r2 + (k_norm - _SMOOTH_PER_M + theta[THINNING]) / r
    grad[SX], grad[SY], grad[SZ] = dx * radial - kx, dy * radial - ky, dz * radial - kz
    grad[LN_STRENGTH], grad[EXPONENT], grad[THINNING] = 1.0, -ln_r, -r
    grad[KX], grad[KY], grad[KZ] = dx - r * kx / k_norm, dy - r * ky / k_norm, dz - r * kz / k_norm
    return np.exp(min(ln_c, MAX_LN_C)), r, np.exp(min(max(off_axis, 0.0), _MAX_LN_RARITY))


@compiled
def log_concentration(dx: float, dy: float, dz: float, theta: Array, r_ref: float, radius: float) -> tuple[float, float, float, float]:
    """ln c, r^2, ln(r / r_ref) and |k| r - k.d at one displacement d from the source."""
    kx, ky, kz = theta[KX], theta[KY], theta[KZ]
    k_norm = np.sqrt(kx * kx + ky * ky + kz * kz + _SMOOTH_PER_M**2)
    r2 = dx * dx + dy * dy + dz * dz + radius * radius
    r = np.sqrt(r2)
    ln_r = np.log(r / r_ref)
    downwind = kx * dx + ky * dy + kz * dz
    off_axis = (k_norm - _SMOOTH_PER_M) * r - downwind
    return theta[LN_STRENGTH] - theta[EXPONENT] * ln_r - off_axis - theta[THINNING] * r, r2, ln_r, off_axis
