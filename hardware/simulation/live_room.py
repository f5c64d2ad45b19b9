"""Gas in the simulated room: the live air with the open source, and whatever `WorldChanges` puts into it."""

import copy
from collections.abc import Sequence
from typing import Protocol, runtime_checkable

from hardware.air.bodies import Field, shadow, with_bodies
from hardware.air.emitter import Emitter
from hardware.simulation.world_changes import WindChange, WorldChanges
from oio.core.errors import BadInput
from oio.core.interfaces import LiveAir
from oio.core.records import Array


@runtime_checkable
class ChangeableAir(LiveAir, Protocol):
    """Air with several, extended and changing sources, and a wind that changes; imported air has a wind of its own."""

    def emit(self, emitters: Sequence[Emitter]) -> None:
        """Replace all sources; their plumes have developed."""
        ...

    def set_wind(self, speed_m_s: float, turned_rad: float, lift_m_s: float) -> None:
        """Change the mean wind from now on."""
        ...


@runtime_checkable
class MeanderingAir(ChangeableAir, Protocol):
    """Air with a slow velocity that all gas shares."""

    def set_meander(self, sd_m_s: float, memory_s: float) -> None:
        """Change its standard deviation per axis and its correlation time from now on."""
        ...


@runtime_checkable
class PuffAir(LiveAir, Protocol):
    """Air of puffs."""

    def set_puffs(self, per_s: float) -> None:
        """Change how many puffs a source releases per second."""
        ...


class LiveRoom:
    """Room of one simulated bench. `changed` tells whether the changes have begun; once begun they stay."""

    def __init__(self, air: LiveAir, changes: WorldChanges, background_ppm: float) -> None:
        self._air, self._changes, self._background_ppm = air, changes, background_ppm
        self._field: Field = air.ppm
        self._source_m: Array | None = None
        self._due: list[WindChange] = []
        self._t_s = 0.0  # since the source opened
        self._changed_s = 0.0  # since the changes began
        self.changed = False

    def present(self, source: str, place_m: Array | None, rate_ml_s: float) -> None:
        """Replace the source; `source` is its name, at which the changes may begin."""
        self.changed = self.changed or self._changes.begins == "start" or source == "source"
        self._source_m, self._t_s, self._field, self._due = place_m, 0.0, self._air.ppm, []
        if not self.changed:
            self._air.present(place_m, rate_ml_s)
            return
        self._begin_wind()
        if self._changes.puffs_per_s is not None:
            if not isinstance(self._air, PuffAir):
                raise BadInput(f"world.puffs_per_s is {self._changes.puffs_per_s:g}, but this air has no puffs. Type e.g. air=still.")
            self._air.set_puffs(self._changes.puffs_per_s)
        if place_m is None:
            self._air.present(None, 0.0)
            return
        self._field = with_bodies(self._air.ppm, self._changes.bodies(place_m))
        emitters = self._changes.emitters(place_m, rate_ml_s)
        if emitters[0].is_plain and len(emitters) == 1:
            self._air.present(place_m, emitters[0].rate_ml_s)
        else:
            self._changeable("a source that is extended, not alone, or not constant").emit(emitters)

    def _begin_wind(self) -> None:
        self._due = list(self._changes.winds())
        if self._changes.meander_m_s is not None:
            if not isinstance(self._air, MeanderingAir):
                raise BadInput(f"world.meander_m_s is {self._changes.meander_m_s:g}, but this air does not meander. Type e.g. air=still.")
            self._air.set_meander(self._changes.meander_m_s, self._changes.meander_s)
        self._blow()

    def _blow(self) -> None:
        while self._due and self._due[0].at_s <= self._t_s:
            wind = self._due.pop(0)
            self._changeable("a wind that changes").set_wind(wind.speed_m_s, wind.turned_rad, wind.lift_m_s)

    def _changeable(self, what: str) -> ChangeableAir:
        if not isinstance(self._air, ChangeableAir):
            raise BadInput(f"world={self._changes.name} has {what}, but this air cannot change. Type e.g. air=still or air=draft.")
        return self._air

    def with_air(self, air: LiveAir) -> "LiveRoom":
        """Return a room of the same history with other air in it; no source is open there."""
        made = copy.copy(self)
        made._air, made._field, made._source_m, made._due = air, air.ppm, None, []
        return made

    def step(self, dt_s: float) -> None:
        """Advance the gas."""
        self._t_s += dt_s
        self._changed_s += dt_s if self.changed else 0.0
        self._blow()
        self._air.step(dt_s)

    def ppm(self, nose_m: Array, joints_m: Array | None) -> float:
        """Concentration at the nose (3,) m, background included [ppm]; `joints_m` (j, 3): ends of the arm's links, for their shadow."""
        background = self._background_ppm + (self._changes.background_ppm(self._changed_s) if self.changed else 0.0)
        gas = self._field(nose_m)
        if self.changed and joints_m is not None and self._source_m is not None:
            gas *= shadow(self._source_m, nose_m, joints_m, self._changes.arm_radius_m, self._changes.arm_transmits)
        return max(background + gas, 0.0)

    @property
    def casts_shadow(self) -> bool:
        """Whether the arm's links matter."""
        return self.changed and self._changes.arm_radius_m > 0.0
