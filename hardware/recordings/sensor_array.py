"""Nose placement in a recording: one fixed position, or the positions of the sensors of an array."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from hardware.recordings.recording_parts import RecordedRows
from oio.core.errors import BadInput
from oio.core.interfaces import Sensor
from oio.core.records import Array
from oio.kinematics.arm import Arm
from oio.tabular.mapping import typed

SAME_PLACE_M = 1e-6


class NosePlacement(Protocol):
    """Protocol of a placement: the joints that give the nose position, and the column recorded there."""

    @property
    def q(self) -> Array:
        """Joint positions (n,) of the unlocked degrees of freedom."""
        ...

    def column(self, element: int) -> int:
        """Column of the recording for this element of the sensor."""
        ...

    def move(self, q_rad: Array) -> None:
        """Move to joint positions (n,), as near as the recording allows."""
        ...


def placement_for(name: str, recorded: RecordedRows, sensor: Sensor, arm: Arm) -> NosePlacement:
    """Create the placement that fits a recording; raises BadInput if the sensor or the arm does not fit."""
    if recorded.place_m is None:
        return FixedPlacement(name, recorded, sensor, arm)
    return ArrayPlacement(name, recorded.place_m, arm)


class FixedPlacement:
    """One fixed position; every element has a column of its own."""

    def __init__(self, name: str, recorded: RecordedRows, sensor: Sensor, arm: Arm) -> None:
        columns = recorded.ppm.shape[1]
        if columns < sensor.elements:
            raise BadInput(
                f"sensor '{sensor.name}' has {_elements(sensor)}, but recording '{name}' plays {columns} column; "
                f"name {sensor.elements} columns in recording.columns=[...]."
            )
        if recorded.guessed and columns > sensor.elements:
            named = typed("columns", recorded.columns[: sensor.elements])
            raise BadInput(
                f"sensor '{sensor.name}' has {_elements(sensor)}, but recording '{name}' has {columns} columns that may be its readings: "
                f"{', '.join(recorded.columns)}. Say which is played, e.g. {named}."
            )
        self._name, self.q = name, arm.home

    def column(self, element: int) -> int:
        """Column of the element."""
        return element

    def move(self, q_rad: Array) -> None:
        """Do nothing; raises BadInput for any other position than the fixed one."""
        if not np.allclose(q_rad, self.q):
            raise BadInput(f"recording '{self._name}' has one fixed place, so its nose cannot move; use stage=[warm_up,baseline].")


def not_played(recorded: RecordedRows, sensor: Sensor) -> str:
    """Return a sentence on the columns of a fixed place that this sensor has no element for; empty if there are none."""
    spare = recorded.columns[sensor.elements :] if recorded.place_m is None else ()
    return f"sensor '{sensor.name}' has {_elements(sensor)}: {', '.join(spare)} of the recording is not played" if spare else ""


def _elements(sensor: Sensor) -> str:
    return "one element" if sensor.elements == 1 else f"{sensor.elements} elements"


class ArrayPlacement:
    """Positions of a sensor array: to move is to read another sensor. Both elements read the sensor at the position.

    The arm must be one whose joints are coordinates. With fewer than three degrees of freedom only the positions on its line or plane
    through `arm.home_rad` are reachable.
    """

    def __init__(self, name: str, place_m: Array, arm: Arm) -> None:
        self._place_m, self._arm = place_m, arm
        self._reachable_sensors = _reachable(place_m, arm)
        if not len(self._reachable_sensors):
            raise BadInput(
                f"recording '{name}' has sensors at {len(place_m)} places of a room, but arm '{arm.name}' with dof={arm.dof} reaches none "
                f"from its home. Type arm=gantry dof=3, or start with arm.home_rad at one of the places."
            )
        self.move(arm.home)

    @property
    def q(self) -> Array:
        """Joint positions of the present sensor, which differ slightly from the commanded ones."""
        return self._place_m[self._sensor, : self._arm.dof]

    def column(self, element: int) -> int:
        """Column of the present sensor, for any element."""
        return self._sensor

    def move(self, q_rad: Array) -> None:
        """Move to the reachable sensor nearest to joint positions (n,)."""
        miss_m = np.linalg.norm(self._place_m[self._reachable_sensors] - self._arm.nose(q_rad), axis=1)
        self._sensor = int(self._reachable_sensors[np.argmin(miss_m)])


def _reachable(place_m: Array, arm: Arm) -> NDArray[np.intp]:
    """Indices of the sensors whose coordinates, taken as joint positions, bring the nose to them."""
    if arm.dof > 3:
        return np.array([], dtype=np.intp)
    miss_m = np.linalg.norm(arm.nose(place_m[:, : arm.dof]) - place_m, axis=1)
    return np.flatnonzero(miss_m < SAME_PLACE_M)
