"""Puff table of one source in float32, and the compiled loops over it, where the simulator spends most of its time.

Rows of the table (ROWS, capacity): position [m], own velocity [m/s], age [s], relative amount of gas, sharpness 1 / 2 sigma^2 [1/m^2],
peak (amount times (2 pi sigma^2)^-1.5) [1/m^3], and the contribution [1/m^3] to the last density.
The loops have no branch and no call, so that the compiler vectorises them, and they sum in sixteen lanes, so that the sum is the same on
every processor.
"""

import math

import numpy as np
from numpy.typing import NDArray

from oio.core.compiled import compiled_like_numpy
from oio.core.records import Array

Table = NDArray[np.float32]
ROWS, AGE, AMOUNT, SHARP, PEAK, SHARE = 11, 6, 7, 8, 9, 10
LANES = 16
_MEAN, _SD = np.float32(3 * 63.5), math.sqrt(3 * (128**2 - 1) / 12)  # mean and standard deviation of the sum of three 7-bit random numbers
FAR = np.float32(12.5)  # five sigma: farther away a puff adds less than 4e-6 of its peak
_SEVEN = np.uint64(127)
_ONE, _32ND = np.float32(1.0), np.float32(1 / 32)
_C2, _C3, _C4, _C5, _C6 = (np.float32(1.0 / math.factorial(n)) for n in range(2, 7))


def table(capacity: int) -> Table:
    """Create an empty table for `capacity` puffs."""
    return np.zeros((ROWS, capacity), dtype=np.float32)


@compiled_like_numpy
def carry(
    puffs: Table, count: int, bits: NDArray[np.uint64], carried_m: Array, keep: float, kick_m_s: float, half_s: float, dt_s: float
) -> None:
    """One step of all puffs: Ornstein-Uhlenbeck velocity v' = keep v + kick n, and position by half_s (v + v') + the common displacement.

    n is the scaled sum of three 7-bit random numbers; nine of them are in a word of `bits` (count,), three for each axis, because normal
    random numbers cost ten times as much. A velocity sums many kicks: at a step of dt its excess kurtosis is -0.4 tanh(dt / eddy time).
    """
    scale, kept, half, dt = np.float32(kick_m_s / _SD), np.float32(keep), np.float32(half_s), np.float32(dt_s)
    for a in range(3):
        place, velocity, way, from_bit = puffs[a], puffs[3 + a], np.float32(carried_m[a]), np.uint64(21 * a)
        for i in range(count):
            word = bits[i] >> from_bit
            three = (word & _SEVEN) + ((word >> np.uint64(7)) & _SEVEN) + ((word >> np.uint64(14)) & _SEVEN)
            old = velocity[i]
            new = kept * old + scale * (np.float32(np.int32(three)) - _MEAN)
            velocity[i] = new
            place[i] += way + half * (old + new)
    age = puffs[AGE]
    for i in range(count):
        age[i] += dt


@compiled_like_numpy
def forget(puffs: Table, count: int, oldest_s: float, farthest_m: float) -> int:
    """Remove each puff that is too old or too far from the base, replacing it by the last; return the number left."""
    x, y, z, age = puffs[0], puffs[1], puffs[2], puffs[AGE]
    oldest, farthest2 = np.float32(oldest_s), np.float32(farthest_m * farthest_m)
    i = 0
    while i < count:
        if age[i] < oldest and x[i] * x[i] + y[i] * y[i] + z[i] * z[i] < farthest2:
            i += 1
        else:
            count -= 1
            for row in range(AMOUNT + 1):
                puffs[row, i] = puffs[row, count]
    return count


@compiled_like_numpy
def grow(puffs: Table, count: int, fresh_m2: float, growth_m2_s: float) -> None:
    """Update sharpness and peak from sigma^2 = fresh + growth * age."""
    age, amount, sharp, peak = puffs[AGE], puffs[AMOUNT], puffs[SHARP], puffs[PEAK]
    fresh, growth, half = np.float32(fresh_m2), np.float32(growth_m2_s), np.float32(0.5)
    unit = np.float32((2.0 * np.pi) ** -1.5)
    for i in range(count):
        inverse = _ONE / (fresh + growth * age[i])
        sharp[i] = half * inverse
        peak[i] = unit * inverse * np.sqrt(inverse) * amount[i]


@compiled_like_numpy
def density(puffs: Table, count: int, p_m: Array) -> float:
    """Sum of peak exp(-sharpness d^2) at p_m (3,) [1/m^3]; exp(-e) is 1 / (Taylor series of exp(e / 32))^32, with error 1e-5 at most."""
    px, py, pz = np.float32(p_m[0]), np.float32(p_m[1]), np.float32(p_m[2])
    x, y, z, sharp, peak, share = puffs[0], puffs[1], puffs[2], puffs[SHARP], puffs[PEAK], puffs[SHARE]
    for i in range(count):
        dx, dy, dz = x[i] - px, y[i] - py, z[i] - pz
        e = sharp[i] * (dx * dx + dy * dy + dz * dz)
        near = min(e, FAR) * _32ND
        root = _ONE + near * (_ONE + near * (_C2 + near * (_C3 + near * (_C4 + near * (_C5 + near * _C6)))))
        root *= root
        root *= root
        root *= root
        root *= root
        root *= root
        share[i] = peak[i] / root if e < FAR else np.float32(0.0)
    whole = count - count % LANES
    sums = np.zeros(LANES, dtype=np.float32)
    for row in share[:whole].reshape(-1, LANES):
        for lane in range(LANES):
            sums[lane] += row[lane]
    total = 0.0
    for lane in range(LANES):
        total += sums[lane]
    for i in range(whole, count):
        total += share[i]
    return total
