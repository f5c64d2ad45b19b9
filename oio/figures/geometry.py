"""Figure geometry: covariance ellipse, source errors with their unit, axis limits, rows of labels."""

import numpy as np

from oio.core.records import Array
from oio.figures.run_history import RunHistory
from oio.figures.track import TrackOverTime
from oio.inference.metrics import CHI2_95, bearing

NORMAL_95 = 1.6448536269514722  # quantile of the normal distribution


def ellipse(mean_m: Array, cov_m2: Array) -> Array:
    """Return the outline (73, 2) m of the 95 % region of x and y, for a mean (3,) m and covariance (3, 3) m^2: chi-square with 2 dof."""
    variances, axes = np.linalg.eigh(cov_m2[:2, :2])
    radii = np.sqrt(CHI2_95[2] * np.maximum(variances, 0.0))
    turn = np.linspace(0.0, 2 * np.pi, 73)
    circle = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    return np.asarray(mean_m[:2] + circle * radii @ axes.T)


def radii_95(cov: Array) -> Array:
    """Return the radius (k,) below which 95 % of the lengths of errors lie that have zero mean and covariances (k, n, n), in their unit.

    The squared length is taken for a scaled chi-square of the same mean and variance (Satterthwaite 1946), its quantile from Wilson and
    Hilferty (1931): within 2 %.
    """
    mean, variance = np.trace(cov, axis1=1, axis2=2), 2.0 * np.sum(cov * np.swapaxes(cov, 1, 2), axis=(1, 2))
    share = 2.0 / 9.0 * variance / np.maximum(2.0 * mean**2, 1e-300)  # 2 / (9 times the degrees of freedom)
    return np.asarray(np.sqrt(mean * (1.0 - share + NORMAL_95 * np.sqrt(share)) ** 3))


def source_errors(story: RunHistory, believed: TrackOverTime) -> tuple[Array, Array, str]:
    """Return error (k,), the bound below which 95 % lie by the belief (k,), and their unit: of position, or of bearing where only that is
    observable."""
    source = story.places["source"]
    if story.dof >= 3:
        return 1e3 * np.linalg.norm(believed.p_m - source, axis=1), 1e3 * radii_95(believed.cov_m2), "mm"
    seen_from = story.shoulder_m
    beliefs = zip(believed.p_m - seen_from, believed.cov_m2, strict=True)
    pairs = [_bearing_error(d, cov, source - seen_from, story.dof) for d, cov in beliefs]
    return np.degrees([error for error, _ in pairs]), np.degrees(radii_95(np.array([cov for _, cov in pairs]))), "deg"


def _bearing_error(d: Array, cov: Array, true_d: Array, dof: int) -> tuple[float, Array]:
    """Error [rad] of the azimuth and its covariance (1, 1); with two joints of azimuth and elevation together, and (2, 2)."""
    angles, jacobian = bearing(d)
    error = (angles - bearing(true_d)[0] + np.pi) % (2 * np.pi) - np.pi
    error[0] *= np.cos(angles[1]) if dof == 2 else 1.0  # a step in azimuth is short near the zenith
    return float(np.linalg.norm(error[:dof])), (jacobian @ cov @ jacobian.T)[:dof, :dof]


def limits(core: Array, rest: Array, width_over_height: float) -> tuple[Array, Array]:
    """Return axis limits (2,), (2,) mm of that aspect ratio that hold all `core` (k, 2) mm, and `rest` (j, 2) mm as far as it is near."""
    low, high = core.min(axis=0), core.max(axis=0)
    margin = 0.3 * float(np.max(high - low))
    shown = np.concatenate([core, np.clip(rest, low - margin, high + margin)])
    low, high = shown.min(axis=0), shown.max(axis=0)
    half = np.maximum(0.5 * (high - low) + 0.06 * float(np.max(high - low)), 50.0)  # a minimum size, even without data
    half = np.maximum(half, half[::-1] * (width_over_height, 1.0 / width_over_height))  # equal scales on both axes
    centre = 0.5 * (low + high)
    return centre - half, centre + half


def rows(middles: list[float], widths: list[float]) -> list[int]:
    """Return a row per label so that labels do not overlap; from left to right, each takes the first free row."""
    ends: list[float] = []
    chosen = []
    for middle, width in zip(middles, widths, strict=True):
        row = next((i for i, end in enumerate(ends) if middle - width / 2 >= end), len(ends))
        ends[row : row + 1] = [middle + width / 2]
        chosen.append(row)
    return chosen
