"""What the source is besides a point: a second source in the same air, the mirror image of the first behind a wall, or an extended source.

Fields add up, and their derivatives with them.
"""

from typing import NamedTuple

import numpy as np

from oio.core.compiled import compiled
from oio.core.records import Array
from oio.gas.extended_source import LINE, extended_source
from oio.gas.range_law import LAW, LN_STRENGTH, SX, SY, SZ, concentration_at


class SecondSource(NamedTuple):
    """Second source as the filter takes it, known: position [m] and ln strength over the first's; ALONE, ANOTHER or MIRRORED. Of an
    extended source (LINE or RING) its half extent [m]."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    ln_ratio: float = 0.0
    kind: int = 0  # ALONE


NO_SECOND_SOURCE = SecondSource()
ALONE, ANOTHER, MIRRORED = 0, 1, 2  # kinds: no second source, one of its own, the mirror image behind a wall
PARAMETERS = np.array([0, 4, 4, 3, 3])  # of each kind, LINE and RING included
BEHIND = 1e-3  # concentration behind a wall, over what the field would be: not zero, so that its logarithm exists


@compiled
def add_second_source(
    p: tuple[float, float, float], theta: Array, second: tuple[float, float, float, float, int], scale: tuple[float, float],
    field: tuple[float, float, float], grad: Array, more: Array,
) -> tuple[float, float, float, float]:  # fmt: skip
    """c, r and rarity of both sources at p, and the share of the first in c; blends `grad` (LAW,), the derivative of ln c by the law.

    `field`: c, r, rarity of the first alone. `more` (LAW,) becomes the derivative of the ln c of the second. The first three entries of
    `grad`, times -1, are the derivative by p only together with (1 - share) times those of `more`. Behind a wall, the plane midway between
    the two, there is next to nothing. Of an extended source, the first entries of `more` are the derivative by its half extent.
    """
    if second[4] >= LINE:
        total, r, rarity = extended_source(p, theta, (second[0], second[1], second[2]), second[4], scale, grad, more)
        return total, r, rarity, 1.0
    c, r, rarity = field
    other = np.empty(LAW)
    other[:] = theta[:LAW]
    other[SX], other[SY], other[SZ] = second[0], second[1], second[2]
    other[LN_STRENGTH] = theta[LN_STRENGTH] + second[3]
    c2, r2, rarity2 = concentration_at(p[0] - second[0], p[1] - second[1], p[2] - second[2], other, scale[0], scale[1], more)
    total = c + c2
    share = c / total
    r, rarity = share * r + (1.0 - share) * r2, share * rarity + (1.0 - share) * rarity2
    if second[4] == MIRRORED:
        nearer = r2_of(p, second) < r2_of(p, (theta[SX], theta[SY], theta[SZ], 0.0, 0))
        total *= BEHIND if nearer else 1.0
    for j in range(LAW):
        grad[j] = share * grad[j] + ((1.0 - share) * more[j] if j > SZ else 0.0)
    return total, r, rarity, share


@compiled
def r2_of(p: tuple[float, float, float], place: tuple[float, float, float, float, int]) -> float:
    """Squared distance of p from a place [m^2]."""
    return (p[0] - place[0]) ** 2 + (p[1] - place[1]) ** 2 + (p[2] - place[2]) ** 2
