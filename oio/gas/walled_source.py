"""A source before a wall, or in a corner of two walls at right angles, as the source and its mirror images.

Exact for diffusion, and for a wind that the wall turns about: no gas goes through the wall (image method, Crank 1975, 2.2.4). The image's
field at a place is the source's at the mirror image of that place, d' = d - 2 (d.w) w / |w|^2 + 2 w for the foot w of the source on the
wall. The images in a corner of two walls are those in each and the one in both. Behind a wall there is no gas: its edge is drawn soft, over
some EDGE_M, because the nose is not known better, and a fit needs a slope to climb.
"""

import numpy as np

from oio.core.compiled import compiled
from oio.core.records import Array
from oio.gas.range_law import LAW, LEAST_PPM, LN_STRENGTH, SX, SZ, concentration_at

BEHIND = 1e-3  # concentration far behind a wall, over what the field would be: not zero, so that its logarithm exists
EDGE_M = 4e-3  # scale of the logistic function between both
LEAST_M2 = 1e-12  # a wall through the source has no normal
Vector = tuple[float, float, float]
NONE = (0.0, 0.0, 0.0)


@compiled
def walled_source(
    d: Vector, theta: Array, feet: tuple[float, float, float, float, float, float], corner: bool, scale: tuple[float, float], grad: Array,
    by_feet: Array,
) -> tuple[float, float, float]:  # fmt: skip
    """c, r and rarity at d from the source with its images; writes the derivatives of ln c by the law to `grad` (LAW,) and by the feet to
    `by_feet` (3,), or (6,) in a corner, where the part of the second foot along the first does not count."""
    u, v, w, own = (feet[0], feet[1], feet[2]), (feet[3], feet[4], feet[5]), NONE, np.empty(LAW)
    uu, uv, ww = max(_dot(u, u), LEAST_M2), _dot(u, v), LEAST_M2
    if corner:
        w = _sum(1.0, v, -uv / uu, u)
        ww = max(_dot(w, w), LEAST_M2)
    du, dw = _dot(d, u), _dot(d, w)
    c = r = rarity = 0.0
    by_d, by_u, by_w = NONE, NONE, NONE  # derivatives of c by minus d and by the feet
    grad[:LAW] = 0.0
    for image in range(4 if corner else 2):
        in_u, in_w = float(image % 2), float(image // 2)
        at = _sum(1.0, _sum(1.0, d, in_u * (2.0 - 2.0 * du / uu), u), in_w * (2.0 - 2.0 * dw / ww), w)
        c_i, r_i, rarity_i = concentration_at(at[0], at[1], at[2], theta, scale[0], scale[1], own)
        c_i = max(c_i, LEAST_PPM)
        c, r, rarity = c + c_i, r + c_i * r_i, rarity + c_i * rarity_i
        for j in range(SZ + 1, LAW):
            grad[j] += c_i * own[j]
        toward = (c_i * own[SX], c_i * own[SX + 1], c_i * own[SZ])  # by minus d'
        by_d = _sum(1.0, by_d, 1.0, _mirrored(toward, in_u, u, uu, in_w, w, ww))
        by_u = _sum(1.0, by_u, in_u, _by_foot(d, u, uu, du, toward))
        by_w = _sum(1.0, by_w, in_w, _by_foot(d, w, ww, dw, toward))
    share, by_height, to_foot = _before_wall(d, u, uu, du)
    by_d, by_u = _sum(1.0 / c, by_d, by_height, u), _sum(1.0 / c, by_u, 1.0, to_foot)
    if corner:
        in_front, by_height, to_foot = _before_wall(d, w, ww, dw)
        share *= in_front
        by_d, by_w = _sum(1.0, by_d, by_height, w), _sum(1.0 / c, by_w, 1.0, to_foot)
        uw = _dot(u, by_w)
        by_u = _sum(1.0, by_u, -uw / uu, v)
        by_u = _sum(1.0, _sum(1.0, by_u, -uv / uu, by_w), 2.0 * uv * uw / (uu * uu), u)
        by_w = _sum(1.0, by_w, -uw / uu, u)
    for a in range(3):
        grad[SX + a], by_feet[a] = by_d[a], by_u[a]
        if corner:
            by_feet[3 + a] = by_w[a]
    for j in range(SZ + 1, LAW):
        grad[j] /= c
    grad[LN_STRENGTH] = 1.0
    return c * share, r / c, rarity / (c * share)


@compiled
def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled
def _sum(x: float, a: Vector, y: float, b: Vector) -> Vector:
    return x * a[0] + y * b[0], x * a[1] + y * b[1], x * a[2] + y * b[2]


@compiled
def _mirrored(a: Vector, in_u: float, u: Vector, uu: float, in_w: float, w: Vector, ww: float) -> Vector:
    """The mirror image of a direction in either plane, or both."""
    return _sum(1.0, _sum(1.0, a, -2.0 * in_u * _dot(a, u) / uu, u), -2.0 * in_w * _dot(a, w) / ww, w)


@compiled
def _by_foot(d: Vector, w: Vector, ww: float, dw: float, toward: Vector) -> Vector:
    """Derivative by the foot w of a concentration at d', whose derivative by minus d' is `toward`; dw = d.w."""
    wt = _dot(w, toward)
    return _sum(1.0, _sum(2.0 * wt / ww, d, 2.0 * (dw / ww - 1.0), toward), -4.0 * dw * wt / (ww * ww), w)


@compiled
def _before_wall(d: Vector, w: Vector, ww: float, dw: float) -> tuple[float, float, Vector]:
    """Share of the gas that is there, one before the wall and BEHIND behind it; the derivatives of its logarithm by s, over w, and by w."""
    size = np.sqrt(ww)
    height = (ww - dw) / size
    there = 1.0 / (1.0 + np.exp(-min(max(height / EDGE_M, -30.0), 30.0)))
    share = BEHIND + (1.0 - BEHIND) * there
    by_height = (1.0 - BEHIND) * there * (1.0 - there) / EDGE_M / share
    return share, by_height / size, _sum(by_height * (2.0 / size - height / ww), w, -by_height / size, d)
