"""Response to RSSI to range and back, and the filter's model of the mean concentration around a source.

ln c(p) = l - n ln(r / r_ref) - (|k| r - k.d) - u r,   d = p - s,   r^2 = |d|^2 + radius^2

n = 1, k = 0 is diffusion from a point, any n with k = 0 the log-distance law of radio (Rappaport), and k = U / 2K the steady plume of a
source in wind U with eddy diffusivity K. u is the thinning of a plume that is still growing or is lost to the room (1 / u is the
length of the isotropic plume of Vergassola et al. 2007). l is the logarithm of the concentration at r_ref. The radius of the source
removes the pole.
"""

from dataclasses import dataclass

import numba
import numpy as np

from oio.errors import BadInput
from oio.fluctuation import Field
from oio.records import Array
from oio.settings import in_range, settings

AIRS = ("evidence", "log_distance", "isotropic", "advection_diffusion", "all")
LAW = 9  # parameters of the law: s (3), l, n, k (3), u
PLAYS_MOST_M, STRAYS_MOST = 1.0, 5.0  # a law that strays by e^5 per e-fold of distance tells nothing, however much more it strays
_SMOOTH_PER_M = 0.5  # |k| is smoothed below this, so that still air (k = 0) has a derivative
_RAREST = np.log(1000.0)  # off-axis puffs are never rarer than this to the model: far out they stop thinning by the law


@settings
class RangeLaw:
    """The nominal law, before anything is calibrated, and how far a real one may be from it (one sigma)."""

    air: str  # which of n, k and u the calibration frees: one of AIRS
    r_ref_m: float  # distance at which l is given
    radius_m: float  # radius of the source
    ln_strength_u: float  # of l about the largest reading seen
    exponent: float  # n
    exponent_u: float
    wind_per_m_u: float  # of each horizontal component of k = U / 2K about still air
    lift_per_m_u: float  # of its vertical component
    thinning_per_m_u: float  # of u about none
    nose_u_m: float  # how well kinematics know the nose from one moment to the next, until calibrated
    nose_choices_m: tuple[float, ...]  # of which calibration takes the likeliest
    stray: float  # how far a real plume strays from the law per e-fold of distance from r_ref (ln C), until calibrated
    stray_choices: tuple[float, ...]  # likewise
    usual_nose_u_m: float  # a choice below this,
    usual_stray: float  # or below this,
    calm_evidence: float  # must be so much likelier, in -2 ln L (Kass & Raftery 1995: above 10 the evidence is very strong)
    gamma: float  # relative fluctuation of the gas on the plume's axis
    eddy_s: float  # its correlation time at r_ref

    def check(self) -> None:
        """Refuse unknown airs and senseless laws."""
        if self.air not in AIRS:
            raise BadInput(f"range.air is '{self.air}', but it can be {', '.join(AIRS[:-1])} or {AIRS[-1]}. Type range.air=all.")
        in_range(self, r_ref_m=(1e-3, 100), radius_m=(1e-4, 1), exponent=(0.1, 6), exponent_u=(1e-6, 5))
        in_range(self, ln_strength_u=(1e-3, 20), wind_per_m_u=(1e-6, 1e3), lift_per_m_u=(1e-6, 1e3), thinning_per_m_u=(1e-6, 1e3))
        in_range(self, nose_u_m=(1e-6, PLAYS_MOST_M), stray=(0, STRAYS_MOST), gamma=(1e-3, 10), eddy_s=(1e-3, 1e3))
        in_range(self, usual_nose_u_m=(0, PLAYS_MOST_M), usual_stray=(0, STRAYS_MOST), calm_evidence=(0, 1e6))
        for key, low, high in (("nose_choices_m", 1e-6, PLAYS_MOST_M), ("stray_choices", 0.0, STRAYS_MOST)):
            choices = getattr(self, key)
            if not choices or not all(low <= choice <= high for choice in choices):
                given = f"range.{key} is {list(choices)}"
                raise BadInput(f"{given}, but it takes one or more of {low:g} to {high:g}. Type e.g. range.{key}=[0.1].")

    @property
    def doubt(self) -> float:
        """What this law's calm costs it, in -2 ln L, against laws that are not calmer than is usual."""
        return self.calm_evidence * ((self.nose_u_m < self.usual_nose_u_m) + (self.stray < self.usual_stray))

    def field(self, c: Array, rarity: Array, r: Array, speed_m_s: Array, exponent: float) -> Field:
        """What fluctuations need to know of the mean field."""
        return Field(c, rarity, r, speed_m_s, exponent * self.nose_u_m, self.stray, self.r_ref_m)


@dataclass(frozen=True, slots=True)
class Rssi:
    """RSSI = 10 log10(C / C_ref) [dB]; r = d0 10^((RSSI0 - RSSI) / 10 n) [m] (log-distance path loss; section II-D of the paper)."""

    c_ref_ppm: float  # concentration of 0 dB
    d0_m: float
    rssi0_db: float  # at d0
    exponent: float

    def of(self, c_ppm: Array) -> Array:
        """Concentrations (k,) ppm to dB; values below a thousandth of C_ref count as that."""
        return 10.0 * np.log10(np.maximum(c_ppm, 1e-3 * self.c_ref_ppm) / self.c_ref_ppm)

    def range_m(self, rssi_db: Array) -> Array:
        """dB to metres."""
        return self.d0_m * 10.0 ** ((self.rssi0_db - rssi_db) / (10.0 * self.exponent))


@numba.njit(cache=True)
def concentration(p: Array, theta: Array, r_ref: float, radius: float) -> tuple[Array, Array, Array, Array]:
    """Mean concentration c (k,) ppm at p (k, 3) m, the derivative of ln c (k, LAW) with respect to theta = (s (3), l, n, k (3), u),
    the distance r (k,) m and the rarity exp(|k| r - k.d) (k,), at most 1000.

    The derivative with respect to p is minus that with respect to s.
    """
    k = p.shape[0]
    c, grad, distance, rarity = np.empty(k), np.empty((k, LAW)), np.empty(k), np.empty(k)
    wx, wy, wz = theta[5], theta[6], theta[7]
    speed = np.sqrt(wx * wx + wy * wy + wz * wz + _SMOOTH_PER_M**2)
    for i in range(k):
        dx, dy, dz = p[i, 0] - theta[0], p[i, 1] - theta[1], p[i, 2] - theta[2]
        r2 = dx * dx + dy * dy + dz * dz + radius * radius
        r = np.sqrt(r2)
        ln_r = np.log(r / r_ref)
        along = wx * dx + wy * dy + wz * dz
        off_axis = (speed - _SMOOTH_PER_M) * r - along
        c[i] = np.exp(min(theta[3] - theta[4] * ln_r - off_axis - theta[8] * r, 50.0))
        distance[i], rarity[i] = r, np.exp(min(max(off_axis, 0.0), _RAREST))
        radial = theta[4] / r2 + (speed - _SMOOTH_PER_M + theta[8]) / r
        grad[i, 0] = dx * radial - wx
        grad[i, 1] = dy * radial - wy
        grad[i, 2] = dz * radial - wz
        grad[i, 3] = 1.0
        grad[i, 4] = -ln_r
        grad[i, 5] = dx - r * wx / speed
        grad[i, 6] = dy - r * wy / speed
        grad[i, 7] = dz - r * wz / speed
        grad[i, 8] = -r
    return c, grad, distance, rarity


@numba.njit(cache=True)
def lagged(c: Array, dc: Array, dt: Array, rise: float, fall: float, f0: float) -> tuple[Array, Array, Array, Array]:
    """First-order lag, c linear in each step (first-order hold): f_i = phi f_{i-1} + w0 c_{i-1} + w1 c_i,
    phi = exp(-dt_i / tau), w1 = 1 - (1 - phi) tau / dt, w0 = 1 - phi - w1; tau is `rise` or `fall` by the sign of c_i - f_{i-1}.

    c (k,) ppm and dc (k, m) its sensitivities, dt (k,) s before each step. Returns f (k,), df (k, m),
    df/d ln(tau) (k,) and the tau (k,) s that each step had.
    """
    k, m = dc.shape
    f, df, df_tau, used = np.empty(k), np.empty((k, m)), np.empty(k), np.empty(k)
    state, sensitivity, to_tau = f0, np.zeros(m), 0.0
    for i in range(k):
        before = i - 1 if i > 0 else 0
        tau = rise if c[i] > state else fall
        x = max(dt[i], 1e-9) / tau
        phi = np.exp(-x)
        share = (1.0 - phi) / x if x > 1e-6 else 1.0 - 0.5 * x
        w1, w0 = 1.0 - share, share - phi
        d_phi = phi * x  # by ln(tau)
        d_share = share - phi
        to_tau = phi * to_tau + state * d_phi - c[i] * d_share + c[before] * (d_share - d_phi)
        state = phi * state + w0 * c[before] + w1 * c[i]
        for j in range(m):
            sensitivity[j] = phi * sensitivity[j] + w0 * dc[before, j] + w1 * dc[i, j]
        f[i], df_tau[i], used[i] = state, to_tau, tau
        df[i] = sensitivity
    return f, df, df_tau, used
