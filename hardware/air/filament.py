"""Puffs in correlated turbulence (Farrell, Murlis, Long, Li, Carde 2002, Environ. Fluid Mech. 2:143): intermittent, as real plumes are.

The source lets out Gaussian puffs at a steady rate. Each is carried by the mean wind, by a meander that all puffs share, and by a
velocity of its own; both are Ornstein-Uhlenbeck processes, stepped exactly, so the spread does not depend on the step. Puffs grow by
sigma^2 = sigma_0^2 + 2 D age. A puff is forgotten when it is too old or too far away. Free space: no table, no walls, no arm.
"""

import math

import numba
import numpy as np

from oio.records import Array
from oio.settings import in_range, settings


@settings
class Filament:
    """One room. Eddy diffusivity of the puffs' own motion is turbulence^2 * eddy_s."""

    name: str
    wind_m_s: float  # mean wind; its direction in the horizontal plane is drawn from the truth stream
    turbulence_m_s: float  # standard deviation of a puff's own velocity, each axis
    eddy_s: float  # its correlation time
    meander_m_s: float  # standard deviation of the shared velocity, each axis
    meander_s: float  # its correlation time
    puffs_per_s: float
    puff_m: float  # sigma_0 of a fresh puff
    growth_m2_s: float  # D
    age_s: float  # a puff older than this is forgotten
    range_m: float  # so is one farther than this from the base
    stood_s: float  # the plume has stood this long when a source is presented; that wait costs no simulated time

    def check(self) -> None:
        """Refuse senseless rooms."""
        in_range(self, wind_m_s=(0, 10), turbulence_m_s=(0, 5), eddy_s=(0.01, 100), meander_m_s=(0, 5), meander_s=(0.01, 1000))
        in_range(self, puffs_per_s=(1, 500), puff_m=(1e-3, 0.5), growth_m2_s=(0, 1), age_s=(1, 600), range_m=(0.1, 100), stood_s=(0, 600))

    def open(self, truth: np.random.Generator, disturbance: np.random.Generator) -> "LiveFilament":
        """Draw the wind's direction."""
        return LiveFilament(self, float(truth.uniform(0, 2 * math.pi)), disturbance)


class LiveFilament:
    """The puffs of one source; memory is bounded by puffs_per_s * age_s."""

    _STAND_STEP_S = 0.05

    def __init__(self, air: Filament, wind_rad: float, rng: np.random.Generator) -> None:
        self._air, self._rng = air, rng
        self.wind_m_s = air.wind_m_s * np.array([math.cos(wind_rad), math.sin(wind_rad), 0.0])
        self._meander = air.meander_m_s * rng.standard_normal(3)
        capacity = int(air.puffs_per_s * (air.age_s + 1)) + 2
        self._position, self._velocity, self._age = np.zeros((capacity, 3)), np.zeros((capacity, 3)), np.zeros(capacity)
        self._count, self._due = 0, 0.0
        self._source_m: Array | None = None
        self._puff_ml = 0.0

    def present(self, source_m: Array | None, emission_ml_s: float) -> None:
        """Replace the source: old gas is aired out, the new plume has stood for `stood_s`."""
        self._source_m, self._puff_ml = source_m, emission_ml_s / self._air.puffs_per_s
        self._count, self._due = 0, 0.0
        if source_m is not None:
            for _ in range(round(self._air.stood_s / self._STAND_STEP_S)):
                self.step(self._STAND_STEP_S)

    def step(self, dt_s: float) -> None:
        """Move, grow, forget and release puffs."""
        air = self._air
        keep = math.exp(-dt_s / air.meander_s)
        self._meander = keep * self._meander + air.meander_m_s * math.sqrt(1 - keep * keep) * self._rng.standard_normal(3)
        carried = self.wind_m_s + self._meander
        self._count = _move(
            self._position, self._velocity, self._age, self._count, dt_s, carried,
            math.exp(-dt_s / air.eddy_s), air.turbulence_m_s, air.age_s, air.range_m, self._rng,
        )  # fmt: skip
        if self._source_m is not None:
            self._release(dt_s)

    def _release(self, dt_s: float) -> None:
        self._due += dt_s * self._air.puffs_per_s
        while self._due >= 1.0:
            self._due -= 1.0
            i = self._count
            self._position[i] = self._source_m
            self._velocity[i] = self._air.turbulence_m_s * self._rng.standard_normal(3)
            self._age[i] = 0.0
            self._count += 1

    def ppm(self, p_m: Array) -> float:
        """Sum over puffs of Q / ((2 pi)^1.5 sigma^3) exp(-d^2 / 2 sigma^2) at (3,) m; 1 ml in 1 m^3 is 1 ppm."""
        a = self._air
        return float(self._puff_ml * _density(self._position, self._age, self._count, p_m, a.puff_m**2, 2 * a.growth_m2_s))


@numba.njit(cache=True)
def _move(
    position: Array, velocity: Array, age: Array, count: int, dt: float, carried: Array,
    keep: float, turbulence: float, oldest: float, farthest: float, rng: np.random.Generator,
) -> int:  # fmt: skip
    kick = turbulence * np.sqrt(1.0 - keep * keep)
    kept = 0
    for i in range(count):
        far = 0.0
        for a in range(3):
            old = velocity[i, a]
            new = keep * old + kick * rng.standard_normal()
            x = position[i, a] + (carried[a] + 0.5 * (old + new)) * dt
            position[kept, a], velocity[kept, a] = x, new
            far += x * x
        age[kept] = age[i] + dt
        if age[kept] < oldest and far < farthest * farthest:
            kept += 1
    return kept


@numba.njit(cache=True)
def _density(position: Array, age: Array, count: int, p: Array, start: float, growth: float) -> float:
    total = 0.0
    for i in range(count):
        variance = start + growth * age[i]
        x = position[i, 0] - p[0]
        if x * x >= 25.0 * variance:
            continue
        d = x * x + (position[i, 1] - p[1]) ** 2 + (position[i, 2] - p[2]) ** 2
        if d < 25.0 * variance:  # beyond five sigma a puff adds less than 4e-6 of its peak
            total += np.exp(-0.5 * d / variance) / (2.0 * np.pi * variance) ** 1.5
    return total
