"""What the source is besides a point: two sources, a line or a ring, or a source before one wall or in a corner of two.

Fields add up, and their derivatives with them.
"""

from typing import NamedTuple

import numpy as np

from oio.core.compiled import compiled
from oio.core.records import Array
from oio.gas.extended_source import extended_source
from oio.gas.range_law import LAW, LEAST_PPM, LN_STRENGTH, SX, SZ, concentration_at
from oio.gas.walled_source import walled_source

POINT, TWO, LINE, RING, WALL, CORNER = 0, 1, 2, 3, 4, 5  # kinds
MOST = 6  # parameters
PARAMETERS = np.array([0, 4, 3, 3, 3, MOST])  # of each kind


class SourceShape(NamedTuple):
    """Kind and parameters of a source's shape, those that the kind does not have being zero.

    TWO: position of the second [m] and ln of its strength over the first's. LINE: from its centre to its end [m]. RING: its normal times
    its radius [m]. WALL: from the source to its foot on the wall [m]. CORNER: the feet on both walls, which are at right angles.
    """

    kind: int = POINT
    parameters: tuple[float, float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

    @staticmethod
    def of(kind: int, parameters: Array) -> "SourceShape":
        """Return the shape with parameters (PARAMETERS[kind],)."""
        a, b, c, d, e, f = [*(float(v) for v in parameters), *(MOST * [0.0])][:MOST]
        return SourceShape(kind, (a, b, c, d, e, f))


POINT_SOURCE = SourceShape()


@compiled
def field_of_shape(
    p: tuple[float, float, float], theta: Array, shape: tuple[int, tuple[float, float, float, float, float, float]],
    scale: tuple[float, float], first: tuple[float, float, float], grad: Array, by_shape: Array,
) -> tuple[float, float, float]:  # fmt: skip
    """c, r and rarity at p of a source of a shape; fills `grad` (LAW,) and `by_shape` (MOST,), the derivatives of ln c.

    `first`: c, r, rarity of a point source, of which `grad` has the derivative at entry. The derivative by p is that of `against_nose`.
    """
    kind, parameters = shape
    if kind == TWO:
        return _two_sources(p, theta, parameters, scale, first, grad, by_shape)
    d = (p[0] - theta[SX], p[1] - theta[SX + 1], p[2] - theta[SZ])
    if kind < WALL:
        return extended_source(d, theta, parameters[:3], kind == RING, scale, grad, by_shape)
    return walled_source(d, theta, parameters, kind == CORNER, scale, grad, by_shape)


@compiled
def against_nose(kind: int, grad: Array, by_shape: Array, axis: int) -> float:
    """Derivative of ln c by minus the nose's place along an axis: shapes move with the source, but for a second source."""
    return float(grad[SX + axis] + (by_shape[axis] if kind == TWO else 0.0))


@compiled
def _two_sources(
    p: tuple[float, float, float], theta: Array, second: tuple[float, float, float, float, float, float], scale: tuple[float, float],
    first: tuple[float, float, float], grad: Array, by_shape: Array,
) -> tuple[float, float, float]:  # fmt: skip
    c, r, rarity = first
    other, more = np.empty(LAW), np.empty(LAW)
    for j in range(LAW):
        other[j] = theta[j]
    other[LN_STRENGTH] += second[3]
    c2, r2, rarity2 = concentration_at(p[0] - second[0], p[1] - second[1], p[2] - second[2], other, scale[0], scale[1], more)
    c, c2 = max(c, LEAST_PPM), max(c2, LEAST_PPM)
    total = c + c2
    share = c / total
    for j in range(LAW):
        grad[j] = share * grad[j] + ((1.0 - share) * more[j] if j > SZ else 0.0)
    for a in range(3):
        by_shape[a] = (1.0 - share) * more[a]
    by_shape[3] = 1.0 - share
    return total, share * r + (1.0 - share) * r2, share * rarity + (1.0 - share) * rarity2
