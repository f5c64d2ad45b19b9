"""Source placement: a position inside a box that the nose can reach closely enough."""

from dataclasses import replace
from typing import Annotated

import numpy as np

from oio.core.errors import BadInput
from oio.core.records import Array
from oio.core.settings import Within, settings
from oio.kinematics.arm import Arm


@settings
class Source:
    """Gas source in the base frame. `position` null: drawn inside the box, from the random stream of the truth."""

    position: Annotated[tuple[float, float, float] | None, Within(-100, 100)]  # m
    box_low_m: Annotated[tuple[float, float, float], Within(-100, 100)]
    box_high_m: Annotated[tuple[float, float, float], Within(-100, 100)]
    approach_m: Annotated[float, Within(1e-3, 1)]  # a source is reachable if the nose can come within this distance
    strength: Annotated[float, Within(0, 1e6)]  # emission rate relative to the sensor's nominal source; 0: drawn, log-normal
    strength_spread: Annotated[float, Within(0, 5)]  # standard deviation of ln(strength) when drawn

    def placed(self, key: str, arm: Arm, rng: np.random.Generator) -> Array:
        """Return the position (3,) [m], drawn if none is configured; raises BadInput if the nose cannot reach it. `key`: for messages."""
        if self.position is not None:
            position = np.array(self.position)
            if not reachable(arm, position, self.approach_m):
                raise BadInput(_out_of_reach(key, position, arm, self.approach_m))
            return position
        for _ in range(1000):
            position = rng.uniform(self.box_low_m, self.box_high_m)
            if reachable(arm, position, self.approach_m):
                return position
        raise BadInput(
            f"no place in {key}.box_low_m {self.box_low_m} to {key}.box_high_m {self.box_high_m} is within reach of '{arm.name}'."
        )

    def strength_drawn(self, rng: np.random.Generator) -> float:
        """Return the emission rate relative to nominal, drawn if it is configured as 0."""
        return self.strength if self.strength > 0 else float(np.exp(self.strength_spread * rng.standard_normal()))


def unlocked(arm: Arm) -> Arm:
    """Return the arm with every joint unlocked: a source is placed for the whole arm, whatever the DoF in use."""
    return replace(arm, dof=max(arm.rungs))


def reachable(arm: Arm, place: Array, approach_m: float) -> bool:
    """Whether some pose of the whole arm brings the nose within approach_m of the position, from one of six directions."""
    whole_arm = unlocked(arm)
    offsets = 0.8 * approach_m * np.array([[-1, 0, 0], [0, 0, 1], [0, 1, 0], [0, -1, 0], [1, 0, 0], [0, 0, -1]], dtype=float)
    return any(whole_arm.solve_ik(place + offset, whole_arm.home, 0.2 * approach_m) is not None for offset in offsets)


def _out_of_reach(key: str, place: Array, arm: Arm, approach_m: float) -> str:
    low, high = arm.box_low_m, arm.box_high_m
    return (
        f"{key}.position is {place.tolist()}, {np.linalg.norm(place):.2f} m from the base, and the nose of '{arm.name}' cannot come within "
        f"{approach_m:g} m of it. In the arm's base frame the nose may go from ({low[0]:g}, {low[1]:g}, {low[2]:g}) to "
        f"({high[0]:g}, {high[1]:g}, {high[2]:g}) m, as far as the links reach. Type e.g. {key}.position=[0.30,0.10,0.15]."
    )
