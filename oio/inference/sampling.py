"""Halton sequence (1960): deterministic low-discrepancy points. (`scipy.stats.qmc` has it too, at 0.7 s of import.)"""

import functools

import numpy as np

from oio.core.records import Array

PRIMES = (2, 3, 5)


@functools.cache
def halton(count: int) -> Array:
    """Return the first `count` points (count, 3) in the unit cube, the origin first; read-only, because they are cached."""
    points = np.array([[_radical_inverse(i, base) for base in PRIMES] for i in range(count)]).reshape(count, 3)
    points.setflags(write=False)
    return points


def _radical_inverse(i: int, base: int) -> float:
    """Radical inverse, the digits of i mirrored at the radix point: 6 = 110 in base 2 becomes 0.011."""
    value, place = 0.0, 1.0 / base
    while i:
        i, digit = divmod(i, base)
        value += digit * place
        place /= base
    return value
