"""Filament model of a plume (Farrell, Murlis, Long, Li, Carde 2002, Environ. Fluid Mech. 2:143): intermittent, as real plumes are.

The source releases Gaussian puffs at a constant rate. Each is carried by the mean wind, by a meander that all puffs share, and by a
velocity of its own; both are Ornstein-Uhlenbeck processes, discretised so that the dispersion does not depend on the step. Puffs grow by
sigma^2 = sigma_0^2 + 2 D age. A puff is removed when it is too old or too far away. Free space: no table, no walls, no arm.
A developed plume is drawn, not simulated: see `hardware.air.aged_plume`.
"""

import math

import numpy as np

from hardware.air import puffs
from hardware.air.aged_plume import VelocityProcess, aged_plume
from oio.core.records import Array
from oio.core.settings import in_range, settings


@settings
class Filament:
    """Filament model of one room. The eddy diffusivity of the puffs' own motion is turbulence^2 * eddy_s."""

    name: str
    wind_m_s: float  # mean wind speed; its horizontal direction is drawn from the truth stream
    turbulence_m_s: float  # standard deviation of a puff's own velocity, each axis
    eddy_s: float  # its correlation time
    meander_m_s: float  # standard deviation of the shared velocity, each axis
    meander_s: float  # its correlation time
    puffs_per_s: float
    puff_m: float  # sigma_0, initial standard deviation of a puff
    growth_m2_s: float  # D, diffusivity that spreads a puff
    age_s: float  # a puff older than this is removed
    range_m: float  # so is one farther than this from the base
    spin_up_s: float  # development time of the plume when a source is presented; takes no simulated time

    def check(self) -> None:
        """Refuse parameters out of range."""
        in_range(self, wind_m_s=(0, 10), turbulence_m_s=(0, 5), eddy_s=(0.01, 100), meander_m_s=(0, 5), meander_s=(0.01, 1000))
        in_range(self, puffs_per_s=(1, 500), puff_m=(1e-3, 0.5), growth_m2_s=(0, 1), age_s=(1, 600), range_m=(0.1, 100), spin_up_s=(0, 600))

    def open(self, truth: np.random.Generator, disturbance: np.random.Generator) -> "LiveFilament":
        """Create the live air; draws the wind direction from `truth`."""
        return LiveFilament(self, float(truth.uniform(0, 2 * math.pi)), disturbance)


class LiveFilament:
    """Puffs of one source; memory is bounded by puffs_per_s * age_s."""

    def __init__(self, air: Filament, wind_rad: float, rng: np.random.Generator) -> None:
        self._air, self._rng = air, rng
        self.wind_m_s = air.wind_m_s * np.array([math.cos(wind_rad), math.sin(wind_rad), 0.0])
        self._own, self._shared = VelocityProcess(air.turbulence_m_s, air.eddy_s), VelocityProcess(air.meander_m_s, air.meander_s)
        self._meander = air.meander_m_s * rng.standard_normal(3)
        self._puffs = puffs.table(int(air.puffs_per_s * (air.age_s + 1)) + 2)
        self._count, self._puffs_due = 0, 0.0
        self._source_m: Array | None = None
        self._puff_ml = 0.0

    @property
    def places_m(self) -> Array:
        """Positions of the puffs (n, 3) m."""
        return self._puffs[:3, : self._count].T.astype(np.float64)

    def present(self, source_m: Array | None, emission_ml_s: float) -> None:
        """Replace the source: the old gas is removed, and the new plume has developed for `spin_up_s`."""
        air = self._air
        self._source_m, self._puff_ml = source_m, emission_ml_s / air.puffs_per_s
        self._count, self._puffs_due = 0, 0.0
        self._meander = self._shared.later(self._meander, air.spin_up_s, self._rng)
        if source_m is not None:
            age_s = np.arange(round(min(air.spin_up_s, air.age_s) * air.puffs_per_s)) / air.puffs_per_s
            places, velocities = aged_plume(age_s, source_m, self.wind_m_s, self._meander, self._own, self._shared, self._rng)
            self._add(places, velocities, age_s)
            self._remove_and_grow()

    def step(self, dt_s: float) -> None:
        """Advance by dt_s: move, grow, remove and release puffs."""
        own, count = self._own, self._count
        self._meander = self._shared.later(self._meander, dt_s, self._rng)
        bits = self._rng.bit_generator.random_raw(count)
        carried_m = (self.wind_m_s + self._meander) * dt_s
        puffs.carry(self._puffs, count, bits, carried_m, own.keep(dt_s), own.kick_m_s(dt_s), own.half_s(dt_s), dt_s)
        if self._source_m is not None:
            self._release(self._source_m, dt_s)
        self._remove_and_grow()

    def _release(self, source_m: Array, dt_s: float) -> None:
        self._puffs_due += dt_s * self._air.puffs_per_s
        fresh = int(self._puffs_due)
        self._puffs_due -= fresh
        self._add(source_m, self._air.turbulence_m_s * self._rng.standard_normal((fresh, 3)), np.zeros(fresh))

    def _add(self, place_m: Array, velocity_m_s: Array, age_s: Array) -> None:
        """Add puffs at place_m (n, 3) or (3,) with velocity_m_s (n, 3) and age_s (n,)."""
        new = slice(self._count, self._count + len(age_s))
        self._puffs[:3, new] = np.atleast_2d(place_m).T
        self._puffs[3:6, new] = velocity_m_s.T
        self._puffs[puffs.AGE, new] = age_s
        self._count = new.stop

    def _remove_and_grow(self) -> None:
        a = self._air
        self._count = puffs.forget(self._puffs, self._count, a.age_s, a.range_m)
        puffs.grow(self._puffs, self._count, a.puff_m**2, 2 * a.growth_m2_s)

    def ppm(self, p_m: Array) -> float:
        """Concentration [ppm] at (3,) m: sum over puffs of Q / ((2 pi)^1.5 sigma^3) exp(-d^2 / 2 sigma^2); 1 ml in 1 m^3 is 1 ppm."""
        return self._puff_ml * puffs.density(self._puffs, self._count, p_m)
