"""The sensor at the nose of the simulated arm: its elements feel the gas where they are, at one place or each at its own."""

from typing import Protocol, runtime_checkable

import numpy as np

from hardware.simulation.live_room import LiveRoom
from hardware.simulation.world_changes import WorldChanges
from oio.core.errors import BadInput
from oio.core.interfaces import PlacedUnit, SensorUnit
from oio.core.records import Array


@runtime_checkable
class SensorChanges(Protocol):
    """Optional protocol of a sensor specimen whose lag and climate can change."""

    def scale_lag(self, factor: float) -> None:
        """Multiply the time constants by a factor from now on."""
        ...

    def scale_climate(self, factor: float) -> None:
        """Multiply the swings of temperature and humidity by a factor from now on."""
        ...


@runtime_checkable
class RenewableNoise(Protocol):
    """Optional protocol of a sensor specimen whose noise can be drawn anew."""

    def renew_noise(self, noise: np.random.Generator) -> None:
        """Take the noise from another generator from now on."""
        ...


class ExposedSensor:
    """A specimen of a sensor whose elements are `apart_m` (E, 3) m from the nose, in its frame.

    `ppm`: concentration at the nose, `element_ppm` at each element. Raises BadInput for elements apart where a unit feels one place alone.
    """

    def __init__(self, unit: SensorUnit, apart_m: Array, background_ppm: float) -> None:
        self.unit, self.apart_m = unit, apart_m
        self.ppm, self.element_ppm = background_ppm, [background_ppm] * len(apart_m)
        self._placed = _placed(unit) if np.any(apart_m) else None

    def expose(self, room: LiveRoom, nose_m: Array, frame: Array, joints_m: Array | None, dt_s: float) -> None:
        """Let the elements feel the gas for dt_s, the nose at nose_m (3,) m with the axes of its frame as columns of `frame` (3, 3).

        They feel the mean over the step: else the gas would lead the nose by half of it.
        """
        before, self.ppm = self.ppm, room.ppm(nose_m, joints_m)
        if self._placed is None:
            self.unit.step(0.5 * (before + self.ppm), dt_s)
            return
        earlier, self.element_ppm = self.element_ppm, [room.ppm(p, joints_m) for p in nose_m + self.apart_m @ frame.T]
        self._placed.step_each([0.5 * (a + b) for a, b in zip(earlier, self.element_ppm, strict=True)], dt_s)

    def change(self, changes: WorldChanges) -> None:
        """Change lag and climate. Raises BadInput where the unit cannot."""
        if (changes.lag_factor, changes.climate_factor) == (1.0, 1.0):
            return
        if not isinstance(self.unit, SensorChanges):
            raise BadInput(
                f"world.lag_factor is {changes.lag_factor:g} and world.climate_factor {changes.climate_factor:g}, but this sensor cannot "
                f"change. Type world.lag_factor=1 world.climate_factor=1."
            )
        self.unit.scale_lag(changes.lag_factor)
        self.unit.scale_climate(changes.climate_factor)

    def renew_noise(self, noise: np.random.Generator) -> None:
        """Take the noise from another generator from now on. Raises BadInput where the unit cannot."""
        if not isinstance(self.unit, RenewableNoise):
            raise BadInput("the sensor is of a kind whose noise cannot be drawn anew, so every search needs a calibration of its own.")
        self.unit.renew_noise(noise)


def _placed(unit: SensorUnit) -> PlacedUnit:
    if not isinstance(unit, PlacedUnit):
        raise BadInput(
            "arm.element_places_m or arm.element_spacing_m puts elements elsewhere than the nose, but a unit of this sensor feels one "
            "concentration alone (it has no `step_each`). Type arm.element_spacing_m=0 and leave element_places_m at zero."
        )
    return unit
