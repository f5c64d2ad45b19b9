"""Changes of the simulated world: what differs from the world that calibration saw, or from the one that the filter assumes."""

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from hardware.air.bodies import Box, Plane
from hardware.air.emitter import SHAPES, Emitter, Release, Shape
from oio.core.errors import BadInput
from oio.core.records import Array
from oio.core.settings import Within, settings

BEGINS = ("search", "start")
SIDES = ("behind", "in_front", "left", "right", "above", "below")
WIND = ("at_s", "speed_m_s", "turned_deg", "lift_m_s")  # of one entry of `wind`


@dataclass(frozen=True, slots=True)
class WindChange:
    """Mean wind from `at_s` on, counted from the opening of the source; at 0 or before, its plume has developed in this wind."""

    at_s: float
    speed_m_s: float
    turned_rad: float  # from the direction that the air drew
    lift_m_s: float


@settings
class WorldChanges:
    """Changes; each key alone, or several together. Positions are relative to the open source, as seen from the arm's base."""

    name: str
    begins: str  # search: when the source to be found opens; start: already in calibration
    walls_m: Annotated[dict[str, float | None], Within(1e-4, 10)]  # side: distance of a wall from the source; null: none
    wall_reflects: Annotated[float, Within(0, 1)]
    box_low_m: Annotated[tuple[float, float, float] | None, Within(-10, 10)]  # corners of a box: towards behind, left, above
    box_high_m: Annotated[tuple[float, float, float] | None, Within(-10, 10)]
    box_transmits: Annotated[float, Within(0, 1)]
    table: bool
    arm_radius_m: Annotated[float, Within(0, 1)]  # radius of the arm's links, which cast a shadow; 0: none
    arm_transmits: Annotated[float, Within(0, 1)]
    further_offsets_m: Annotated[tuple[tuple[float, float, float], ...], Within(-10, 10)]  # of further sources: behind, left, above
    further_strengths: Annotated[tuple[float, ...], Within(1e-6, 1e6)]  # over that of the source
    strength_factor: Annotated[float, Within(1e-6, 1e6)]  # of all sources
    puffs_per_s: Annotated[float | None, Within(0.1, 500)]
    shape: str
    size_m: Annotated[float, Within(0, 1)]
    shape_axis: Annotated[tuple[float, float, float], Within(-1e3, 1e3)]
    starts_s: Annotated[float, Within(0, 1e6)]
    fade_s: Annotated[float | None, Within(0.1, 1e7)]
    pulse_s: Annotated[float | None, Within(0.01, 1e5)]
    pulse_duty: Annotated[float, Within(0.01, 1)]
    background_step_ppm: Annotated[float, Within(-1e6, 1e6)]
    background_step_s: Annotated[float, Within(0, 1e6)]
    background_ramp_ppm_per_min: Annotated[float, Within(-1e5, 1e5)]
    wind: Annotated[tuple[tuple[float, float, float, float], ...], Within(-1e6, 1e6)]  # see WIND
    meander_m_s: Annotated[float | None, Within(0, 5)]
    meander_s: Annotated[float, Within(0.01, 1e4)]
    nose_offset_m: Annotated[tuple[float, float, float], Within(-1, 1)]  # in the frame of the nose site
    drift_factor: Annotated[float, Within(0, 1e3)]
    lag_factor: Annotated[float, Within(0.01, 100)]
    climate_factor: Annotated[float, Within(0, 1e3)]  # of the swings of temperature and humidity
    backlash_deg: Annotated[float | None, Within(0, 20)]

    def check(self) -> None:
        """Raise BadInput for unknown words, and lists that do not match."""
        self._check_word("begins", self.begins, BEGINS)
        self._check_word("shape", self.shape, SHAPES)
        for side in self.walls_m:
            self._check_word("walls_m", side, SIDES)
        self._check_lists()

    def _check_word(self, key: str, word: str, allowed: tuple[str, ...]) -> None:
        if word not in allowed:
            raise BadInput(f"world.{key} has '{word}', but it can be {', '.join(allowed[:-1])} or {allowed[-1]}. Type e.g. {allowed[0]}.")

    def _check_lists(self) -> None:
        if len(self.further_offsets_m) != len(self.further_strengths):
            raise BadInput(
                f"world.further_offsets_m has {len(self.further_offsets_m)} entries and world.further_strengths is "
                f"{list(self.further_strengths)}, but every further source needs both. "
                f"Type e.g. world.further_offsets_m=[[0,0.15,0]] world.further_strengths=[0.6]."
            )
        if (self.box_low_m is None) != (self.box_high_m is None) or not np.all(np.less(self.box_low_m or 0.0, self.box_high_m or 1.0)):
            raise BadInput(
                f"world.box_low_m is {self.box_low_m} and world.box_high_m {self.box_high_m}, but a box needs both, the low corner below "
                f"the high one. Type e.g. world.box_low_m=[0.03,-0.05,-0.05] world.box_high_m=[0.08,0.05,0.05]."
            )
        if any(not 0.0 <= speed <= 10.0 for _, speed, _, _ in self.wind) or not any(self.shape_axis):
            raise BadInput(
                f"world.wind is {[list(w) for w in self.wind]} and world.shape_axis {list(self.shape_axis)}, but a wind is "
                f"{', '.join(WIND)} with a speed of 0 to 10 m/s, and an axis is not zero. Type e.g. world.wind=[[0,0.1,0,0]]."
            )

    def winds(self) -> tuple[WindChange, ...]:
        """The wind's schedule, in order of time."""
        return tuple(WindChange(at, speed, math.radians(turned), lift) for at, speed, turned, lift in sorted(self.wind))

    def emitters(self, source_m: Array, rate_ml_s: float) -> tuple[Emitter, ...]:
        """The source at (3,) m and the further ones, with shape and emission over time (further sources are points)."""
        release = Release(
            self.starts_s, math.inf if self.fade_s is None else self.fade_s, math.inf if self.pulse_s is None else self.pulse_s,
            1.0 if self.pulse_s is None else self.pulse_duty,
        )  # fmt: skip
        rate_ml_s *= self.strength_factor
        frame, shape = seen_from_base(source_m), Shape(self.shape, self.size_m, self.shape_axis)
        further = zip(self.further_offsets_m, self.further_strengths, strict=True)
        others = (Emitter(source_m + np.array(offset) @ frame, strength * rate_ml_s, release=release) for offset, strength in further)
        return (Emitter(source_m, rate_ml_s, shape, release), *others)

    def bodies(self, source_m: Array) -> tuple[Plane | Box, ...]:
        """Walls, box and table about the source at (3,) m; walls last, so that one hides whatever is behind it."""
        behind, left, above = seen_from_base(source_m)
        towards = {"behind": behind, "in_front": -behind, "left": left, "right": -left, "above": above, "below": -above}
        found: list[Plane | Box] = []
        if self.box_low_m is not None and self.box_high_m is not None:
            corners = np.array([source_m + np.array(c) @ np.stack([behind, left, above]) for c in (self.box_low_m, self.box_high_m)])
            found.append(Box(corners.min(axis=0), corners.max(axis=0), source_m, transmits=self.box_transmits))
        if self.table:
            found.append(Plane(np.zeros(3), np.array([0.0, 0.0, 1.0])))
        walls = (
            Plane(source_m + d * towards[side], -towards[side], self.wall_reflects) for side, d in self.walls_m.items() if d is not None
        )
        return (*found, *walls)

    def background_ppm(self, t_s: float) -> float:
        """Background above that of the sensor's room, t_s after the change began [ppm]."""
        return self.background_step_ppm * (t_s >= self.background_step_s) + self.background_ramp_ppm_per_min * t_s / 60.0


def seen_from_base(place_m: Array) -> Array:
    """Unit vectors (rows) behind, left, above: horizontally away from the base, to its left, and up."""
    away = np.array([place_m[0], place_m[1], 0.0])
    norm = float(np.linalg.norm(away))
    behind = away / norm if norm > 1e-9 else np.array([1.0, 0.0, 0.0])
    return np.array([behind, [-behind[1], behind[0], 0.0], [0.0, 0.0, 1.0]])
