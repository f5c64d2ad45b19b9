"""Filament model of a plume (Farrell, Murlis, Long, Li, Carde 2002, Environ. Fluid Mech. 2:143): intermittent, as real plumes are.

Every source releases Gaussian puffs at a constant rate, of an amount of gas that its emission sets. Each is carried by the mean wind, by
a meander that all puffs share, and by a velocity of its own; both are Ornstein-Uhlenbeck processes, discretised so that the dispersion
does not depend on the step. Puffs grow by sigma^2 = sigma_0^2 + 2 D age. A puff is removed when it is too old or too far away. Free
space: `hardware.air.bodies` puts walls into it. A developed plume is drawn, not simulated: see `hardware.air.aged_plume`.
"""

import math
from collections.abc import Sequence
from typing import Annotated

import numpy as np

from hardware.air import puffs
from hardware.air.aged_plume import VelocityProcess, plume_sway
from hardware.air.emitter import STEADY, Emitter
from oio.core.records import Array
from oio.core.settings import Within, settings


@settings
class Filament:
    """Filament model of one room. The eddy diffusivity of the puffs' own motion is turbulence^2 * eddy_s."""

    name: str
    wind_m_s: Annotated[float, Within(0, 10)]  # mean wind speed; its horizontal direction is drawn from the truth stream
    turbulence_m_s: Annotated[float, Within(0, 5)]  # standard deviation of a puff's own velocity, each axis
    eddy_s: Annotated[float, Within(0.01, 100)]  # its correlation time
    meander_m_s: Annotated[float, Within(0, 5)]  # standard deviation of the shared velocity, each axis
    meander_s: Annotated[float, Within(0.01, 1000)]  # its correlation time
    puffs_per_s: Annotated[float, Within(1, 500)]
    puff_m: Annotated[float, Within(1e-3, 0.5)]  # sigma_0, initial standard deviation of a puff
    growth_m2_s: Annotated[float, Within(0, 1)]  # D, diffusivity that spreads a puff
    age_s: Annotated[float, Within(1, 600)]  # a puff older than this is removed
    range_m: Annotated[float, Within(0.1, 100)]  # so is one farther than this from the base
    spin_up_s: Annotated[float, Within(0, 600)]  # development time of the plume when a source is presented; takes no simulated time

    def open(self, truth: np.random.Generator, disturbance: np.random.Generator) -> "LiveFilament":
        """Create the live air; draws the wind direction from `truth`."""
        return LiveFilament(self, float(truth.uniform(0, 2 * math.pi)), disturbance)


class LiveFilament:
    """Puffs of the open sources; memory is bounded by the puffs per second * age_s for each."""

    def __init__(self, air: Filament, wind_rad: float, rng: np.random.Generator) -> None:
        self._air, self._rng, self._wind_rad = air, rng, wind_rad
        self.wind_m_s = air.wind_m_s * np.array([math.cos(wind_rad), math.sin(wind_rad), 0.0])
        self._own, self._shared = VelocityProcess(air.turbulence_m_s, air.eddy_s), VelocityProcess(air.meander_m_s, air.meander_s)
        self._meander = air.meander_m_s * rng.standard_normal(3)
        self._per_s = air.puffs_per_s
        self._puffs = puffs.table(self._per_source)
        self._count, self._puffs_due, self._released, self._t_s = 0, 0.0, 0, 0.0
        self._emitters: tuple[Emitter, ...] = ()
        self._puff_ml = 0.0

    @property
    def _per_source(self) -> int:
        """Most puffs of one source."""
        return int(self._per_s * (self._air.age_s + 1)) + 2

    @property
    def places_m(self) -> Array:
        """Positions of the puffs (n, 3) m."""
        return self._puffs[:3, : self._count].T.astype(np.float64)

    def present(self, source_m: Array | None, emission_ml_s: float) -> None:
        """Replace all sources by a point, or by none: the old gas is removed, and the new plume has developed for `spin_up_s`."""
        self.emit(() if source_m is None else (Emitter(source_m, emission_ml_s),))

    def emit(self, emitters: Sequence[Emitter]) -> None:
        """Replace all sources; their puffs share the wind and the meander, present and past, and each has a velocity of its own."""
        air = self._air
        self._begin(emitters, 0.0)
        self._meander = self._shared.later(self._meander, air.spin_up_s, self._rng)
        age_s = np.arange(round(min(air.spin_up_s, air.age_s) * self._per_s)) / self._per_s
        sway: Array | None = None
        for emitter in emitters:
            displacements, velocities = self._own.since(age_s, self._rng)
            sway = plume_sway(age_s, self._meander, self._shared, self._rng) if sway is None else sway
            start = emitter.place_m + emitter.shape.offsets_m(-len(age_s), len(age_s))
            self._add(start + age_s[:, None] * self.wind_m_s + sway + displacements, velocities, age_s, self._amount(emitter, -age_s))
        if emitters:
            self._remove_and_grow()

    def _begin(self, emitters: Sequence[Emitter], t_s: float) -> None:
        """Replace all sources, without any gas yet; it is t_s before or after their opening."""
        self._emitters = tuple(emitters)
        self._puff_ml = max((e.rate_ml_s for e in emitters), default=0.0) / self._per_s
        self._count, self._puffs_due, self._released, self._t_s = 0, 0.0, 0, t_s
        if self._puffs.shape[1] < len(emitters) * self._per_source:
            self._puffs = puffs.table(len(emitters) * self._per_source)

    def carry(self, moved_m: Array) -> None:
        """Move every puff by its row of moved_m (n, 3) m."""
        self._puffs[:3, : self._count] += moved_m.T.astype(np.float32)

    def set_wind(self, speed_m_s: float, turned_rad: float, lift_m_s: float) -> None:
        """Change the mean wind from now on; `turned_rad` is counted from the direction that was drawn when the air was opened."""
        angle = self._wind_rad + turned_rad
        self.wind_m_s = np.array([speed_m_s * math.cos(angle), speed_m_s * math.sin(angle), lift_m_s])

    def set_meander(self, sd_m_s: float, memory_s: float) -> None:
        """Change the velocity that all puffs share from now on: its standard deviation per axis and its correlation time."""
        self._meander = self._meander * (sd_m_s / self._shared.sd_m_s) if self._shared.sd_m_s > 0.0 else self._meander
        self._shared = VelocityProcess(sd_m_s, memory_s)

    def set_puffs(self, per_s: float) -> None:
        """Change how many puffs a source releases per second, from its next opening on; their gas is as much as before."""
        self._per_s = per_s

    def step(self, dt_s: float) -> None:
        """Advance by dt_s: move, grow, remove and release puffs."""
        own, count = self._own, self._count
        self._meander = self._shared.later(self._meander, dt_s, self._rng)
        bits = self._rng.bit_generator.random_raw(count)
        carried_m = (self.wind_m_s + self._meander) * dt_s
        puffs.carry(self._puffs, count, bits, carried_m, own.keep(dt_s), own.kick_m_s(dt_s), own.half_s(dt_s), dt_s)
        self._t_s += dt_s
        if self._emitters:
            self._release(dt_s)
        self._remove_and_grow()

    def _release(self, dt_s: float) -> None:
        self._puffs_due += dt_s * self._per_s
        fresh = int(self._puffs_due)
        self._puffs_due -= fresh
        now_s = np.full(fresh, self._t_s)
        for emitter in self._emitters:
            velocities = self._air.turbulence_m_s * self._rng.standard_normal((fresh, 3))
            places = emitter.place_m + emitter.shape.offsets_m(self._released, fresh)
            self._add(places, velocities, np.zeros(fresh), self._amount(emitter, now_s))
        self._released += fresh

    def _amount(self, emitter: Emitter, t_s: Array) -> Array:
        """Gas in the puffs that an emitter releases at t_s (n,), over that of the strongest source at its full rate."""
        share = emitter.release.share(t_s) if emitter.release != STEADY else np.ones(len(t_s))
        return emitter.rate_ml_s / (self._puff_ml * self._per_s) * share if self._puff_ml else np.zeros(len(t_s))

    def _add(self, places_m: Array, velocities_m_s: Array, age_s: Array, amount: Array) -> None:
        """Add puffs at places_m (n, 3) with velocities_m_s (n, 3), age_s (n,) and relative amount of gas (n,)."""
        new = slice(self._count, self._count + len(age_s))
        self._puffs[:3, new] = places_m.T
        self._puffs[3:6, new] = velocities_m_s.T
        self._puffs[puffs.AGE, new] = age_s
        self._puffs[puffs.AMOUNT, new] = amount
        self._count = new.stop

    def _remove_and_grow(self) -> None:
        a = self._air
        self._count = puffs.forget(self._puffs, self._count, a.age_s, a.range_m)
        puffs.grow(self._puffs, self._count, a.puff_m**2, 2 * a.growth_m2_s)

    def ppm(self, p_m: Array) -> float:
        """Concentration [ppm] at (3,) m: sum over puffs of Q / ((2 pi)^1.5 sigma^3) exp(-d^2 / 2 sigma^2); 1 ml in 1 m^3 is 1 ppm."""
        return self._puff_ml * puffs.density(self._puffs, self._count, p_m)
