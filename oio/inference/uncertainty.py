"""Eq. (2) Type A, eq. (3) Type B, and what an honest evaluation (JCGM 100, GUM) makes of the same data."""

from dataclasses import dataclass

import numpy as np

from oio.core.records import Array

STATIC_SOURCE_Q_M2_S = 1e-10  # process noise of a source that stands still, for the numerics [m^2/s]


@dataclass(frozen=True, slots=True)
class TypeA:
    """One rung of the DoF ladder: window k, spread s of its bouts, u_a of the paper, and u_a with the readings' effective number."""

    dof: int
    k: int
    s_ppm: float
    u_a_ppm: float
    u_a_effective_ppm: float
    bouts: int
    moves: int


@dataclass(frozen=True, slots=True)
class TypeB:
    """Localising a known source: moves m per repeat, misses v, u_b of the paper (mean over repeats) and the RMS of v (GUM)."""

    moves: int
    misses_m: tuple[float, ...]
    u_b_m: float
    rms_m: float
    inflation: float  # how much too small the fits' covariances are: mean NEES of the repeats over its expectation, at least 1, times
    # nu / (nu - 2) with nu = 3 n degrees of freedom, for it is itself an estimate (the variance of Student's t; GUM G.3)


def type_a(s_ppm: float, k: float) -> float:
    """u_a = s / sqrt(k) [ppm], eq. (2); k may be an effective number of readings."""
    return s_ppm / float(np.sqrt(k))


def type_b(miss_m: float, moves: int) -> float:
    """u_b = 2 v / sqrt(m) [m], eq. (3)."""
    return 2.0 * miss_m / float(np.sqrt(moves))


def type_b_of_repeats(misses_m: Array, nees: Array, moves: int) -> TypeB:
    """Type B from the misses (n,) m of n repeats with `moves` moves each, and their NEES (n,) under the covariances of their fits."""
    paper = float(np.mean([type_b(v, moves) for v in misses_m]))
    nu = 3 * len(misses_m)
    inflation = max(1.0, float(np.mean(nees)) / 3.0) * nu / (nu - 2)
    return TypeB(moves, tuple(float(v) for v in misses_m), paper, float(np.sqrt(np.mean(np.square(misses_m)))), inflation)


@dataclass(frozen=True, slots=True)
class Noise:
    """Q and R as one assembly makes them. `gum`: both follow from the model, r_ppm2 is None and source_q_m2 is near 0.

    `paper`: u_a and u_b on the diagonals as they stand, ppm taken for ppm^2 and m for m^2 per step of the filter.
    """

    assembly: str
    source_q_m2: float  # added to the source's variance: per second (gum) or per step of the filter (paper)
    r_ppm2: float | None  # variance of a reading; None: that of one fresh reading at its concentration
    source_p0_m2: float  # added to the covariance of the source, each axis, for a map of `measurements`; less in proportion for more
    measurements: int  # that a repeat of the calibration had
    inflation: float  # factor on the covariance of what the beacon taught

    @staticmethod
    def nominal() -> "Noise":
        """What holds before any Type B is known: R is that of a fresh reading, the source stands still."""
        return Noise("gum", source_q_m2=STATIC_SOURCE_Q_M2_S, r_ppm2=None, source_p0_m2=0.0, measurements=1, inflation=1.0)


def assemble_q_r(assembly: str, u_a_ppm: float, type_b: TypeB) -> Noise:
    """Q and R from the two uncertainties.

    `gum`: u_b says how far the map's vertex is off, so its RMS over repeats enters P0 of the source (a third per axis, and less for a map
    of more measurements than a repeat had), not Q: a source that stands still has no process noise. The covariance of the fit is scaled
    until it explains the misses. u_a is the uncertainty of a mean, so R is the variance of one fresh reading instead.
    """
    if assembly == "paper":
        return Noise(assembly, source_q_m2=type_b.u_b_m, r_ppm2=u_a_ppm, source_p0_m2=0.0, measurements=1, inflation=1.0)
    return Noise(
        "gum",
        source_q_m2=STATIC_SOURCE_Q_M2_S,
        r_ppm2=None,
        source_p0_m2=type_b.rms_m**2 / 3.0,
        measurements=type_b.moves + 1,
        inflation=type_b.inflation,
    )
