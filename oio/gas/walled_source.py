"""A source before a wall, or in a corner of two walls at right angles, as the source and its mirror images.

Exact for diffusion, and for a wind that the wall turns about: no gas goes through the wall (image method, Crank 1975, 2.2.4). The image's
field at a place is the source's at the mirror image of that place, d' = d - 2 (d.w) w / |w|^2 + 2 w for the foot w of the source on the
wall. The images in a corner of two walls are those in each and the one in both. Behind a wall there is no gas: its edge is drawn soft, over
some EDGE_M, because the nose is not known better, and a fit needs a slope to climb.
"""

import numpy as np

from oio.core.compiled import compiled
from oio.core.records import Array
from oio.gas.range_law import LAW, LN_STRENGTH, SX, SZ, concentration_at

BEHIND = 1e-3  # concentration far behind a wall, over what the field would be: not zero, so that its logarithm exists
EDGE_M = 4e-3  # scale of the logistic function between both
LEAST_M2 = 1e-12  # a wall through the source has no normal


@compiled
def walled_source(
    d: tuple[float, float, float], theta: Array, feet: tuple[float, float, float, float, float, float], corner: bool,
    scale: tuple[float, float], grad: Array, by_feet: Array,
) -> tuple[float, float, float]:  # fmt: skip
    """c, r and rarity at d from the source with its images; writes the derivatives of ln c by the law to `grad` (LAW,) and by the feet to
    `by_feet` (3,), or (6,) in a corner, where the part of the second foot along the first does not count."""
    u, v, w = np.empty(3), np.empty(3), np.zeros(3)
    for a in range(3):
        u[a], v[a] = feet[a], feet[3 + a]
    uu, uv, vv = max(u @ u, LEAST_M2), u @ v, LEAST_M2
    if corner:
        w[:] = v - uv / uu * u
        vv = max(w @ w, LEAST_M2)
    place, at, toward, by_u, by_w = np.array(d), np.empty(3), np.empty(3), np.zeros(3), np.zeros(3)
    own, du, dw = np.empty(LAW), place @ u, place @ w
    c = r = rarity = 0.0
    grad[:LAW] = 0.0
    for image in range(4 if corner else 2):
        in_u, in_w = image % 2, image // 2
        at[:] = place + in_u * (2.0 - 2.0 * du / uu) * u + in_w * (2.0 - 2.0 * dw / vv) * w
        c_i, r_i, rarity_i = concentration_at(at[0], at[1], at[2], theta, scale[0], scale[1], own)
        c, r, rarity = c + c_i, r + c_i * r_i, rarity + c_i * rarity_i
        for j in range(SZ + 1, LAW):
            grad[j] += c_i * own[j]
        toward[:] = c_i * own[SX : SZ + 1]  # derivative by minus d'
        ut, wt = u @ toward, w @ toward
        grad[SX : SZ + 1] += toward - in_u * 2.0 * ut / uu * u - in_w * 2.0 * wt / vv * w
        if in_u:
            by_u += _by_foot(place, u, uu, du, toward, ut)
        if in_w:
            by_w += _by_foot(place, w, vv, dw, toward, wt)
    for a in range(3):
        grad[SX + a] /= c
    by_u, by_w = by_u / c, by_w / c
    before = _before_wall(place, u, uu, du, grad, by_u)
    if corner:
        before *= _before_wall(place, w, vv, dw, grad, by_w)
        uw = u @ by_w
        by_u -= uw / uu * v + uv / uu * by_w - 2.0 * uv * uw / (uu * uu) * u
        by_w -= uw / uu * u
        by_feet[3:6] = by_w
    by_feet[:3] = by_u
    for j in range(SZ + 1, LAW):
        grad[j] /= c
    grad[LN_STRENGTH] = 1.0
    return c * before, r / c, rarity / (c * before)


@compiled
def _by_foot(d: Array, w: Array, ww: float, dw: float, toward: Array, wt: float) -> Array:
    """Derivative (3,) by the foot w of a concentration at d', whose derivative by minus d' is `toward`; dw = d.w, wt = w.toward."""
    return 2.0 * (wt / ww * d + (dw / ww - 1.0) * toward - 2.0 * dw * wt / (ww * ww) * w)


@compiled
def _before_wall(d: Array, w: Array, ww: float, dw: float, grad: Array, by_foot: Array) -> float:
    """Share of the gas that is there: one before the wall, BEHIND behind it; adds the derivatives of its logarithm by s and w."""
    size = np.sqrt(ww)
    height = (ww - dw) / size
    there = 1.0 / (1.0 + np.exp(-min(max(height / EDGE_M, -30.0), 30.0)))
    share = BEHIND + (1.0 - BEHIND) * there
    slope = (1.0 - BEHIND) * there * (1.0 - there) / EDGE_M / share  # of the logarithm, by height
    for a in range(3):
        grad[SX + a] += slope * w[a] / size
        by_foot[a] += slope * ((2.0 * w[a] - d[a]) / size - height * w[a] / ww)
    return share
