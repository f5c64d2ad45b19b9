"""A plume that has stood for a while, drawn from the law that its puffs would have if they had been moved step by step.

A puff of age t is where the mean wind, the shared meander since its birth and its own velocity have brought it. Both velocities are
stationary Ornstein-Uhlenbeck processes, whose velocity and way are jointly Gaussian (Uhlenbeck & Ornstein 1930, Phys. Rev. 36:823).
"""

import math
from dataclasses import dataclass

import numpy as np

from oio.core.compiled import compiled
from oio.core.records import Array


@dataclass(frozen=True, slots=True)
class VelocityProcess:
    """An Ornstein-Uhlenbeck velocity: standard deviation of each axis, correlation time."""

    sd_m_s: float
    memory_s: float

    def keep(self, dt_s: float) -> float:
        """What is left of a velocity after dt_s."""
        return math.exp(-dt_s / self.memory_s)

    def kick_m_s(self, dt_s: float) -> float:
        """Standard deviation of what has come in its stead."""
        return self.sd_m_s * math.sqrt(-math.expm1(-2 * dt_s / self.memory_s))

    def half_s(self, dt_s: float) -> float:
        """h of the way h (v + v') of one step; with it the eddy diffusivity is sd^2 memory at any step, and h is dt / 2 for short ones."""
        half = 0.5 * dt_s / self.memory_s
        return 0.5 * dt_s * math.sqrt(math.tanh(half) / half)

    def later(self, velocity_m_s: Array, dt_s: float, rng: np.random.Generator) -> Array:
        """The velocity (3,) m/s after dt_s."""
        return self.keep(dt_s) * velocity_m_s + self.kick_m_s(dt_s) * rng.standard_normal(3)

    def since(self, age_s: Array, rng: np.random.Generator) -> tuple[Array, Array]:
        """Ways (n, 3) m in age_s (n,), and velocities (n, 3) m/s at their ends, each drawn by itself: given v at the end, the way has mean
        T (1 - e) v and variance sd^2 T^2 (2 (s - 1 + e) - (1 - e)^2), e = exp(-s), s = age / T."""
        s = age_s[:, None] / self.memory_s
        lost = -np.expm1(-s)
        spread = np.sqrt(np.maximum(2 * (s - lost) - lost * lost, 0.0))
        velocity = self.sd_m_s * rng.standard_normal((len(age_s), 3))
        return self.memory_s * (lost * velocity + self.sd_m_s * spread * rng.standard_normal(velocity.shape)), velocity


def aged_plume(
    age_s: Array,
    source_m: Array,
    wind_m_s: Array,
    meander_m_s: Array,
    own: VelocityProcess,
    shared: VelocityProcess,
    rng: np.random.Generator,
) -> tuple[Array, Array]:
    """Places (n, 3) m and own velocities (n, 3) m/s of puffs of age_s (n,), evenly spaced from 0; the meander is meander_m_s (3,) now."""
    ways, velocities = own.since(age_s, rng)
    dt_s = float(age_s[1]) if len(age_s) > 1 else 1.0
    normals = rng.standard_normal((len(age_s), 3))
    sway = _sway(normals, meander_m_s, shared.keep(dt_s), shared.kick_m_s(dt_s), shared.half_s(dt_s))
    return source_m + age_s[:, None] * wind_m_s + sway + ways, velocities


@compiled
def _sway(normals: Array, now_m_s: Array, keep: float, kick_m_s: float, half_s: float) -> Array:
    """How far (n, 3) m the shared velocity has carried what was let out 0, 1, 2 ... steps ago; backwards in time it has the same law."""
    way = np.zeros_like(normals)
    for a in range(3):
        later = now_m_s[a]
        for i in range(1, len(normals)):
            earlier = keep * later + kick_m_s * normals[i, a]
            way[i, a] = way[i - 1, a] + half_s * (later + earlier)
            later = earlier
    return way
