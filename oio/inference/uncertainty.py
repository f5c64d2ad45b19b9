"""Type A (eq. 2) and Type B (eq. 3) uncertainty, their evaluation by the GUM (JCGM 100), and the assembly of Q and R."""

from dataclasses import dataclass

import numpy as np

from oio.core.records import Array
from oio.gas.bouts import Bout, effective_samples

STATIC_SOURCE_Q_M2_S = 1e-10  # process noise of a source that stands still, for the numerics [m^2/s]


@dataclass(frozen=True, slots=True)
class TypeA:
    """Type A uncertainty of one rung of the DoF ladder: window k, spread s of its bouts, u_a of the paper and by effective sample size."""

    dof: int
    k: int
    s_ppm: float
    u_a_ppm: float
    u_a_effective_ppm: float
    bouts: int
    moves: int


@dataclass(frozen=True, slots=True)
class TypeB:
    """Type B uncertainty from localising a known source: moves m and error v of each repeat, u_b of the paper (mean), RMS of v (GUM)."""

    moves: tuple[int, ...]
    misses_m: tuple[float, ...]
    u_b_m: float
    rms_m: float
    inflation: float  # covariance inflation factor: mean NEES of the repeats over its expectation, at least 1, times
    # nu / (nu - 2) with nu = 3 n degrees of freedom, because it is itself an estimate (variance of Student's t; GUM G.3)
    unexplained_m2: float  # mean square of v beyond the inflated covariances of the repeats' fits, at least 0


def type_a(s_ppm: float, k: float) -> float:
    """Type A uncertainty u_a = s / sqrt(k) [ppm], eq. (2); k may be an effective sample size."""
    return s_ppm / float(np.sqrt(k))


def type_a_of_bouts(dof: int, k: int, steps: list[Bout], sample_s: float, tau_rise_s: float, moves: int) -> TypeA:
    """Type A uncertainty of a rung from the steps of its bout rule, of window k over readings every `sample_s` through a lag: the root
    mean square of the spread within the bouts, or within all steps if none was a bout."""
    fired = [b for b in steps if b.fired]
    spreads = [b.spread_ppm for b in fired or steps]
    s = float(np.sqrt(np.mean(np.square(spreads)))) if spreads else 0.0
    worth = effective_samples(k, sample_s, tau_rise_s)
    return TypeA(dof, k, s, type_a(s, k), type_a(s, worth), len(fired), moves)


def type_b(miss_m: float, moves: int) -> float:
    """Type B uncertainty u_b = 2 v / sqrt(m) [m], eq. (3)."""
    return 2.0 * miss_m / float(np.sqrt(moves))


def type_b_of_repeats(misses_m: Array, nees: Array, moves: tuple[int, ...], traces_m2: Array) -> TypeB:
    """Type B uncertainty from the position errors (n,) [m] of n repeats, the NEES (n,) and covariance traces (n,) [m^2] of their fits, and
    the moves that each took."""
    paper = float(np.mean([type_b(v, m) for v, m in zip(misses_m, moves, strict=True)]))
    nu = 3 * len(misses_m)
    inflation = max(1.0, float(np.mean(nees)) / 3.0) * nu / (nu - 2)
    square = float(np.mean(np.square(misses_m)))
    unexplained = max(square - inflation * float(np.mean(traces_m2)), 0.0)
    return TypeB(moves, tuple(float(v) for v in misses_m), paper, float(np.sqrt(square)), inflation, unexplained)


@dataclass(frozen=True, slots=True)
class Noise:
    """Process and measurement noise (Q, R) of one assembly. `gum`: both follow from the model, r_ppm2 is None and source_q_m2 near 0.

    `paper`: u_a and u_b unsquared on the diagonals, ppm taken as ppm^2 and m as m^2 per step of the filter.
    """

    assembly: str
    source_q_m2: float  # added to the source's variance: per second (gum) or per step of the filter (paper)
    r_ppm2: float | None  # variance of a reading; None: that of a single reading at its concentration
    source_p0_m2: float  # added to the covariance of the source, each axis, for a map of `measurements`; less in proportion for more
    measurements: int  # per repeat of the calibration, on average
    inflation: float  # factor on the covariance of the beacon fit

    @staticmethod
    def nominal() -> "Noise":
        """Noise before any Type B is available: R of a single reading, static source."""
        return Noise("gum", source_q_m2=STATIC_SOURCE_Q_M2_S, r_ppm2=None, source_p0_m2=0.0, measurements=1, inflation=1.0)


def assemble_q_r(assembly: str, u_a_ppm: float, type_b: TypeB) -> Noise:
    """Assemble Q and R from Type A and Type B uncertainty.

    `gum`: u_b is the position error of the map's vertex, so it belongs into P0 of the source, not Q: a static source has no process noise.
    The covariance of a map has most of it already; it is inflated to explain the errors of the repeats, and what of their mean square is
    still unexplained is added (a third per axis, and less for a map of more measurements than a repeat had). u_a is the
    uncertainty of a mean, so R is the variance of a single reading instead.
    """
    if assembly == "paper":
        return Noise(assembly, source_q_m2=type_b.u_b_m, r_ppm2=u_a_ppm, source_p0_m2=0.0, measurements=1, inflation=1.0)
    return Noise(
        "gum",
        source_q_m2=STATIC_SOURCE_Q_M2_S,
        r_ppm2=None,
        source_p0_m2=type_b.unexplained_m2 / 3.0,
        measurements=round(float(np.mean(type_b.moves))) + 1,
        inflation=type_b.inflation,
    )
