"""An extended source, a line or a ring, as points that share its strength: Gauss-Legendre points of the line, equal arcs of the ring."""

import numpy as np

from oio.core.compiled import compiled
from oio.core.records import Array
from oio.gas.range_law import LAW, LEAST_PPM, LN_STRENGTH, SX, SZ, concentration_at

NODES, WEIGHTS = np.polynomial.legendre.leggauss(5)
ARCS = 8
SIN, COS = np.sin(2.0 * np.pi * np.arange(ARCS) / ARCS), np.cos(2.0 * np.pi * np.arange(ARCS) / ARCS)
LEAST_M = 1e-6  # a ring of no radius has no normal


@compiled
def extended_source(
    d: tuple[float, float, float], theta: Array, half: tuple[float, float, float], ring: bool, scale: tuple[float, float], grad: Array,
    by_half: Array,
) -> tuple[float, float, float]:  # fmt: skip
    """c, r and rarity at d from the centre of the source; writes the derivatives of ln c by the law to `grad` (LAW,) and by `half` to
    `by_half` (3,).

    `half`: from the centre of a line to its end [m], or a ring's normal times its radius [m]. The ring's points at e, unit vectors normal
    to h, move by dp = (e h' - h e') dh / |h|.
    """
    own, place = np.empty(LAW), np.empty(3)
    one, two, size = np.zeros(3), np.zeros(3), np.sqrt(half[0] ** 2 + half[1] ** 2 + half[2] ** 2) + LEAST_M
    points = len(NODES)
    if ring:
        points = ARCS
        _plane(half, one, two)
    c = r = rarity = 0.0
    grad[:LAW] = 0.0
    by_half[:3] = 0.0
    for i in range(points):
        if ring:
            for a in range(3):
                place[a] = COS[i] * one[a] + SIN[i] * two[a]
            reach, weight = size, 1.0 / ARCS
        else:
            for a in range(3):
                place[a] = half[a]
            reach, weight = NODES[i], 0.5 * WEIGHTS[i]
        dx, dy, dz = d[0] - reach * place[0], d[1] - reach * place[1], d[2] - reach * place[2]
        c_i, r_i, rarity_i = concentration_at(dx, dy, dz, theta, scale[0], scale[1], own)
        share = weight * max(c_i, LEAST_PPM)
        c, r, rarity = c + share, r + share * r_i, rarity + share * rarity_i
        for j in range(LAW):
            grad[j] += share * own[j]
        if ring:
            outwards = own[SX] * place[0] + own[SX + 1] * place[1] + own[SZ] * place[2]
            upwards = (own[SX] * half[0] + own[SX + 1] * half[1] + own[SZ] * half[2]) / size
            for a in range(3):
                by_half[a] += share * (outwards * half[a] / size - upwards * place[a])
        else:
            for a in range(3):
                by_half[a] += share * reach * own[SX + a]
    for j in range(LAW):
        grad[j] /= c
    for a in range(3):
        by_half[a] /= c
    grad[LN_STRENGTH] = 1.0
    return c, r / c, rarity / c


@compiled
def _plane(normal: tuple[float, float, float], one: Array, two: Array) -> None:
    """Two unit vectors (3,) normal to `normal` and to each other."""
    x, y, z = normal
    size = np.sqrt(x * x + y * y + z * z)
    if size < LEAST_M:
        x, y, z, size = 0.0, 0.0, 1.0, 1.0
    x, y, z = x / size, y / size, z / size
    if abs(x) < 0.6:
        one[0], one[1], one[2] = 0.0, z, -y
    else:
        one[0], one[1], one[2] = -z, 0.0, x
    length = np.sqrt(one[0] ** 2 + one[1] ** 2 + one[2] ** 2)
    for a in range(3):
        one[a] /= length
    two[0], two[1], two[2] = y * one[2] - z * one[1], z * one[0] - x * one[2], x * one[1] - y * one[0]
