"""Trilateration: two spheres intersect in a circle, a third in two points, a fourth in one, the "Voronoi vertex" of the paper (II-D)."""

from dataclasses import dataclass

import numpy as np

from oio.core.errors import NotObservable
from oio.core.records import Array
from oio.inference.forward_model import Problem

ROUNDING = 1e-9  # relative to the largest length
MOST_RATIO2 = 1e60  # limit on ratios of squared ranges; weights are their inverse fourth powers of range
SMOOTHED = 5  # readings averaged before the lag is inverted, which multiplies their noise by tau / dt
DETECTION_SIGMAS = 3.0  # detection threshold, in standard deviations above the baseline: below it a reading gives no range


@dataclass(frozen=True, slots=True, eq=False)
class Circle:
    """Circle in space: centre (3,) [m], radius [m], unit normal (3,)."""

    centre: Array
    radius: float
    normal: Array


def sphere_intersection(c1: Array, r1: float, c2: Array, r2: float) -> Circle:
    """Intersection circle of two spheres, of radius 0 if they touch; raises NotObservable with the gap if they do not intersect."""
    separation = c2 - c1
    d = float(np.linalg.norm(separation))
    if d < 1e-9:
        raise NotObservable("the two spheres have the same centre: move the nose between sniffs.")
    gap = max(d - r1 - r2, abs(r1 - r2) - d)
    if gap > ROUNDING * max(d, r1, r2):
        raise NotObservable(f"the two spheres miss each other by {1e3 * gap:.3g} mm: a range or the source strength is wrong.")
    along = (d * d + r1 * r1 - r2 * r2) / (2 * d)
    height2 = max(r1 * r1 - along * along, 0.0)  # touching spheres meet in a point, and rounding must not separate them
    return Circle(c1 + along * separation / d, float(np.sqrt(height2)), separation / d)


def circle_sphere_intersection(ring: Circle, c3: Array, r3: float) -> tuple[Array, Array]:
    """Intersection of a circle with a third sphere: two points, mirror images in the plane of the centres; raises NotObservable if none."""
    offset = c3 - ring.centre
    height = float(offset @ ring.normal)
    in_plane = offset - height * ring.normal
    d = float(np.linalg.norm(in_plane))
    if d < 1e-9:
        raise NotObservable("the third centre lies on the axis of the circle: the three centres are in line.")
    radius2 = r3 * r3 - height * height
    along = (d * d + ring.radius**2 - radius2) / (2 * d)
    across2 = ring.radius**2 - along * along
    if radius2 < 0 or across2 < 0:
        raise NotObservable("the third sphere misses the circle of the first two: a range or the source strength is wrong.")
    x = in_plane / d
    across = np.sqrt(across2) * np.cross(ring.normal, x)
    return ring.centre + along * x + across, ring.centre + along * x - across


def vertex(centres: Array, radii: Array) -> Array:
    """Least-squares intersection (3,) [m] of k >= 4 spheres, linearised: 2 (p_i - p_0).s = |p_i|^2 - |p_0|^2 - r_i^2 + r_0^2.

    Rows are weighted by 1 / r^2, because the error of a range grows with the range. Raises NotObservable if the centres (k, 3)
    lie in a plane or on a line.
    """
    if len(centres) < 4:
        raise NotObservable(f"{len(centres)} spheres leave more than one point; sniff at {4 - len(centres)} more places.")
    order = np.argsort(radii)
    p, r = centres[order], radii[order]
    weight = 1.0 / np.maximum(r[1:], 1e-6) ** 2
    rows = 2.0 * (p[1:] - p[0]) * weight[:, None]
    right = (np.sum(p[1:] ** 2, axis=1) - p[0] @ p[0] - r[1:] ** 2 + r[0] ** 2) * weight
    singular_values = np.linalg.svd(p[1:] - p[0], compute_uv=False)
    if singular_values[2] < 1e-3 * singular_values[0]:
        shape = "on a line" if singular_values[1] < 1e-3 * singular_values[0] else "in a plane, which leaves two mirror points"
        raise NotObservable(f"all sniffs lie {shape}; move another joint.")
    return np.asarray(np.linalg.lstsq(rows, right, rcond=None)[0])


def vertex_unknown_strength(centres: Array, ratios: Array) -> Array:
    """Least-squares intersection (3,) [m] of k >= 5 spheres of unknown source strength: with radius ratios rho (k,), r_i^2 = kappa rho_i^2,
    2 (p_i - p_0).s + kappa (rho_i^2 - rho_0^2) = |p_i|^2 - |p_0|^2, linear in s and kappa.

    Rows are weighted by 1 / rho^4: the error of rho^2, in both columns, grows with it and biases kappa towards zero. Raises
    NotObservable if the centres (k, 3) and ratios leave a direction undetermined.
    """
    if len(centres) < 5:
        raise NotObservable(f"{len(centres)} spheres leave more than one point; sniff at {5 - len(centres)} more places.")
    order = np.argsort(ratios)
    p, rho2 = centres[order], (ratios[order] / max(float(np.min(ratios)), 1e-12)) ** 2
    if not (float(np.min(rho2)) > 1.0 / MOST_RATIO2 and float(np.max(rho2)) < MOST_RATIO2):  # a range law this flat gives no range
        raise NotObservable("the ratio of the ranges is too large for floating point; the range law is too flat.")
    scale = max(float(np.ptp(p)), 1e-9)  # metres and squared ratios in one matrix
    rows = np.column_stack([2.0 * (p[1:] - p[0]) / scale, rho2[1:] - rho2[0]])
    right = np.sum(p[1:] ** 2, axis=1) - p[0] @ p[0]
    weight = 1.0 / rho2[1:] ** 2
    answer, _, rank, _ = np.linalg.lstsq(weight[:, None] * rows, weight * right, rcond=1e-10)
    if rank < 4:
        raise NotObservable("the sniffs leave the strength or a direction open; move another joint.")
    return np.asarray(answer[:3] / scale)


def linear_source(problem: Problem, nose_m: Array) -> Array:
    """Linear source estimate (1, 3) [m] from differenced spheres, or empty (0, 3): a biased start for the fit, at one small solve.

    The sensor's lag is inverted by c + tau dc/dt; `nose_m` (k, 3) is the nose along the path. rho = c^(-1/n).
    """
    sn, lay, theta = problem.sniffs, problem.layout, problem.mean
    c = (sn.ppm - theta[lay.baseline][sn.element]) / np.exp(theta[lay.gain])[sn.element]
    times, first, inverse = np.unique(sn.reading_t_s, return_index=True, return_inverse=True)
    c = np.bincount(inverse, c) / np.bincount(inverse)  # mean over elements that are read at the same time
    if len(times) < 2 * SMOOTHED:
        return np.empty((0, 3))
    window = np.ones(SMOOTHED) / SMOOTHED
    smooth, slope = (np.convolve(x, window, "same") for x in (c, np.gradient(c, times)))
    c = smooth + problem.rise_s * np.exp(theta[lay.tau]) * slope
    detected = c > DETECTION_SIGMAS * sn.sigma_ppm[first]
    try:
        with np.errstate(over="ignore", divide="ignore", invalid="ignore"):  # non-finite ranges raise NotObservable
            return vertex_unknown_strength(nose_m[sn.at[first]][detected], c[detected] ** (-1.0 / theta[lay.exponent]))[None, :]
    except NotObservable:
        return np.empty((0, 3))


def dilution_of_precision(centres: Array, source: Array) -> float:
    """Geometric dilution of precision of log-ranging with unknown strength: sqrt(tr (G'G)^-1 of the source) [m per unit of ln C].

    Rows G_i = (-d_i / r_i^2, 1); infinite if the geometry is unobservable.
    """
    d = centres - source
    rows = np.column_stack([d / np.sum(d * d, axis=1, keepdims=True), np.ones(len(d))])
    information = rows.T @ rows
    if np.linalg.cond(information) > 1e12:
        return float("inf")
    return float(np.sqrt(np.trace(np.linalg.inv(information)[:3, :3])))
