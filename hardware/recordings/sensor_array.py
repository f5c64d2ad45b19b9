"""Where the nose is in a recording: at one fixed place, or at one of the places where a sensor of an array hung."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from hardware.recordings.recording_parts import RecordedRows
from oio.core.errors import BadInput
from oio.core.interfaces import Sensor
from oio.core.records import Array
from oio.kinematics.arm import Arm

SAME_PLACE_M = 1e-6


class NosePlacement(Protocol):
    """The joints that say where the nose is, and the column that holds what it smells there."""

    @property
    def q(self) -> Array:
        """Joints (n,) of the unlocked degrees of freedom."""
        ...

    def column(self, element: int) -> int:
        """The column of the recording for this element of the sensor."""
        ...

    def move(self, q_rad: Array) -> None:
        """Go to joints (n,), as near as the recording allows."""
        ...


def placement_for(name: str, recorded: RecordedRows, sensor: Sensor, arm: Arm) -> NosePlacement:
    """The nose that fits a recording; raises BadInput if the sensor or the arm does not."""
    if recorded.place_m is None:
        return FixedPlacement(name, recorded, sensor, arm)
    return ArrayPlacement(name, recorded.place_m, arm)


class FixedPlacement:
    """One place; every element has a column of its own."""

    def __init__(self, name: str, recorded: RecordedRows, sensor: Sensor, arm: Arm) -> None:
        columns = recorded.ppm.shape[1]
        if columns < sensor.elements:
            raise BadInput(
                f"sensor '{sensor.name}' has {sensor.elements} elements, but recording '{name}' plays {columns} column; "
                f"name {sensor.elements} columns in recording.columns=[...]."
            )
        self._name, self.q = name, arm.home

    def column(self, element: int) -> int:
        """The element's own column."""
        return element

    def move(self, q_rad: Array) -> None:
        """Stay; raises BadInput for any other place than this."""
        if not np.allclose(q_rad, self.q):
            raise BadInput(f"recording '{self._name}' has one fixed place, so its nose cannot move; use stage=[warm_up,baseline].")


class ArrayPlacement:
    """Many places, one sensor at each: to move is to listen to another. Both elements read the sensor at the place.

    The arm must be one whose joints are positions. With fewer than three degrees of freedom only the places on its line or plane
    through `arm.home_rad` are open.
    """

    def __init__(self, name: str, place_m: Array, arm: Arm) -> None:
        self._place_m, self._arm = place_m, arm
        self._open = _reached(place_m, arm)
        if not len(self._open):
            raise BadInput(
                f"recording '{name}' has sensors at {len(place_m)} places of a room, but arm '{arm.name}' with dof={arm.dof} reaches none "
                f"from its home. Type arm=gantry dof=3, or start with arm.home_rad at one of the places."
            )
        self.move(arm.home)

    @property
    def q(self) -> Array:
        """The joints at the place, which is not quite where they were sent."""
        return self._place_m[self._at, : self._arm.dof]

    def column(self, element: int) -> int:
        """The sensor at the place, whichever element."""
        return self._at

    def move(self, q_rad: Array) -> None:
        """Go to the open place nearest to joints (n,)."""
        miss_m = np.linalg.norm(self._place_m[self._open] - self._arm.nose(q_rad), axis=1)
        self._at = int(self._open[np.argmin(miss_m)])


def _reached(place_m: Array, arm: Arm) -> NDArray[np.intp]:  # indices of the places where joints as coordinates bring the nose
    if arm.dof > 3:
        return np.array([], dtype=np.intp)
    miss_m = np.linalg.norm(arm.nose(place_m[:, : arm.dof]) - place_m, axis=1)
    return np.flatnonzero(miss_m < SAME_PLACE_M)
