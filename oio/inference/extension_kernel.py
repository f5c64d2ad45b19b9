"""Compiled extension of the range law (see `oio.inference.law_extension`): the law at a time, and the field of a source of a shape."""

from typing import NamedTuple

from oio.core.compiled import compiled
from oio.core.records import Array
from oio.gas.range_law import KX, LAW, LN_STRENGTH
from oio.gas.source_shape import MOST, PARAMETERS, SourceShape, field_of_shape


class LawScale(NamedTuple):
    """Reference distance and source radius of a range law."""

    r_ref_m: float
    radius_m: float


class Knots(NamedTuple):
    """Extension of the law: the shape of the source, the knots [s] of what changes with time, piecewise linear between them, and whether
    the encoders drift anew.

    Parameters are those of the shape; then the changes at all knots but the first, of ln strength and wind (3 each); the additional drift
    (n) rad/s^2 of the joints, from the first point of the path on; the background.
    """

    source: int  # kind of its shape, see `oio.gas.source_shape`
    strength_s: Array
    wind_s: Array
    background_s: Array
    joints: int  # 0: the encoders drift as at calibration


@compiled
def parameters_of_law(knots: Knots) -> int:
    """Number of parameters that change the law of the field; those of joints and background follow them."""
    walks = max(len(knots.strength_s) - 1, 0) + 3 * max(len(knots.wind_s) - 1, 0)
    return int(PARAMETERS[knots.source]) + walks


@compiled
def knot_weights(knots_s: Array, t: float) -> tuple[tuple[int, float], tuple[int, float]]:
    """The two parameters of a random walk that matter at t, and their weights; the first knot has none, and the ends extend."""
    last = len(knots_s) - 1
    if t <= knots_s[0]:
        return (0, 0.0), (0, 0.0)
    if t >= knots_s[last]:
        return (last - 1, 1.0), (last - 1, 0.0)
    j = 0
    while knots_s[j + 1] < t:
        j += 1
    right = (t - knots_s[j]) / (knots_s[j + 1] - knots_s[j])
    return (max(j - 1, 0), 1.0 - right if j > 0 else 0.0), (j, right)


@compiled
def law_at(theta: Array, knots: Knots, size: int, t: float, law: Array) -> None:
    """Fill law (LAW,) with the parameters of the range law at time t; the extension's begin at `size` in theta (P,)."""
    for j in range(LAW):
        law[j] = theta[j]
    at = size + PARAMETERS[knots.source]
    if len(knots.strength_s) > 1:
        for j, weight in knot_weights(knots.strength_s, t):
            law[LN_STRENGTH] += weight * theta[at + j]
        at += len(knots.strength_s) - 1
    if len(knots.wind_s) > 1:
        for j, weight in knot_weights(knots.wind_s, t):
            for a in range(3):
                law[KX + a] += weight * theta[at + 3 * j + a]


@compiled
def extended_field(
    theta: Array, knots: Knots, size: int, t: float, place: tuple[float, float, float], law: Array, scale: LawScale,
    field: tuple[float, float, float], grad: Array, row: Array, more: Array,
) -> tuple[float, float, float]:  # fmt: skip
    """c, r and rarity with the shape of the source; fills the row with the derivatives of ln c by the extension.

    `field`, `grad` (LAW,): c, r, rarity and derivative of a point; `grad` becomes that of the shape.
    """
    c, r, rarity = field
    row[:] = 0.0
    at = 0
    if knots.source:
        at = PARAMETERS[knots.source]
        more[:MOST] = 0.0
        for j in range(at):
            more[j] = theta[size + j]
        shape = SourceShape(knots.source, (more[0], more[1], more[2], more[3], more[4], more[5]))
        c, r, rarity = field_of_shape(place, law, shape, (scale.r_ref_m, scale.radius_m), field, grad, more)
        for j in range(at):
            row[j] = more[j]
    if len(knots.strength_s) > 1:
        for j, weight in knot_weights(knots.strength_s, t):
            row[at + j] += weight
        at += len(knots.strength_s) - 1
    if len(knots.wind_s) > 1:
        for j, weight in knot_weights(knots.wind_s, t):
            for a in range(3):
                row[at + 3 * j + a] += weight * grad[KX + a]
    return c, r, rarity
