"""Developed plume, sampled directly from the distribution that its puffs would have after stepwise simulation.

A puff of age t is where the mean wind, the shared meander since its release and its own velocity have carried it. Both velocities are
stationary Ornstein-Uhlenbeck processes, with jointly Gaussian velocity and displacement (Uhlenbeck & Ornstein 1930, Phys. Rev. 36:823).
"""

import math
from dataclasses import dataclass

import numpy as np

from oio.core.compiled import compiled
from oio.core.records import Array


@dataclass(frozen=True, slots=True)
class VelocityProcess:
    """Ornstein-Uhlenbeck velocity process: standard deviation of each axis, correlation time."""

    sd_m_s: float
    memory_s: float

    def keep(self, dt_s: float) -> float:
        """Autocorrelation exp(-dt / T) of the velocity after dt_s."""
        return math.exp(-dt_s / self.memory_s)

    def kick_m_s(self, dt_s: float) -> float:
        """Standard deviation of the velocity's random increment over dt_s [m/s]."""
        return self.sd_m_s * math.sqrt(-math.expm1(-2 * dt_s / self.memory_s))

    def half_s(self, dt_s: float) -> float:
        """Factor h of the displacement h (v + v') of one step [s]: the eddy diffusivity is sd^2 T at any step; dt / 2 for short ones."""
        half = 0.5 * dt_s / self.memory_s
        return 0.5 * dt_s * math.sqrt(math.tanh(half) / half)

    def later(self, velocity_m_s: Array, dt_s: float, rng: np.random.Generator) -> Array:
        """Return the velocity (3,) m/s after dt_s."""
        return self.keep(dt_s) * velocity_m_s + self.kick_m_s(dt_s) * rng.standard_normal(3)

    def since(self, age_s: Array, rng: np.random.Generator) -> tuple[Array, Array]:
        """Draw displacements (n, 3) m over age_s (n,) and final velocities (n, 3) m/s, independently per puff.

        Given the final velocity v, the displacement has mean T (1 - e) v and variance sd^2 T^2 (2 (s - 1 + e) - (1 - e)^2), e = exp(-s),
        s = age / T.
        """
        s = age_s[:, None] / self.memory_s
        lost = -np.expm1(-s)
        spread = np.sqrt(np.maximum(2 * (s - lost) - lost * lost, 0.0))
        velocity = self.sd_m_s * rng.standard_normal((len(age_s), 3))
        return self.memory_s * (lost * velocity + self.sd_m_s * spread * rng.standard_normal(velocity.shape)), velocity


def plume_sway(age_s: Array, meander_m_s: Array, shared: VelocityProcess, rng: np.random.Generator) -> Array:
    """Draw the displacements (n, 3) m by the shared velocity of puffs of age_s (n,), evenly spaced from 0; present meander (3,) m/s."""
    dt_s = float(age_s[1]) if len(age_s) > 1 else 1.0
    normals = rng.standard_normal((len(age_s), 3))
    return _sway(normals, meander_m_s, shared.keep(dt_s), shared.kick_m_s(dt_s), shared.half_s(dt_s))


@compiled
def _sway(normals: Array, now_m_s: Array, keep: float, kick_m_s: float, half_s: float) -> Array:
    """Displacement (n, 3) m by the shared velocity of puffs released 0, 1, 2 ... steps ago; the process is time-reversible."""
    way = np.zeros_like(normals)
    for a in range(3):
        later = now_m_s[a]
        for i in range(1, len(normals)):
            earlier = keep * later + kick_m_s * normals[i, a]
            way[i, a] = way[i - 1, a] + half_s * (later + earlier)
            later = earlier
    return way
