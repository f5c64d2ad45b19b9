"""Where a source may stand: in a box, with room for the nose near it, and where the nose can go."""

from dataclasses import replace

import numpy as np

from oio.core.errors import BadInput
from oio.core.records import Array
from oio.core.settings import settings
from oio.kinematics.arm import Arm


@settings
class Source:
    """A gas source in the base frame. `position` null means: drawn from the truth stream inside the box."""

    position: tuple[float, float, float] | None  # m
    box_low_m: tuple[float, float, float]
    box_high_m: tuple[float, float, float]
    approach_m: float  # a source counts as reachable if the nose can come this near
    strength: float  # emission relative to the sensor's nominal source; 0: drawn, log-normal
    strength_spread: float  # 1-sigma of ln(strength) when drawn

    def placed(self, key: str, arm: Arm, rng: np.random.Generator) -> Array:
        """The place (3,) m, drawn if none is given; raises BadInput if the nose cannot come near it. `key` names it in errors."""
        if self.position is not None:
            place = np.array(self.position)
            if not reachable(arm, place, self.approach_m):
                raise BadInput(_out_of_reach(key, place, arm, self.approach_m))
            return place
        for _ in range(1000):
            place = rng.uniform(self.box_low_m, self.box_high_m)
            if reachable(arm, place, self.approach_m):
                return place
        raise BadInput(
            f"no place in {key}.box_low_m {self.box_low_m} to {key}.box_high_m {self.box_high_m} is within reach of '{arm.name}'."
        )

    def strength_drawn(self, rng: np.random.Generator) -> float:
        """Strength relative to nominal."""
        return self.strength if self.strength > 0 else float(np.exp(self.strength_spread * rng.standard_normal()))


def unlocked(arm: Arm) -> Arm:
    """The same arm with every joint unlocked: a source is placed for the arm, whatever rung it uses."""
    return replace(arm, dof=max(arm.ladder))


def reachable(arm: Arm, place: Array, approach_m: float) -> bool:
    """Whether some pose of the whole arm brings the nose within approach_m of the place, from one of the six sides."""
    free = unlocked(arm)
    offsets = 0.8 * approach_m * np.array([[-1, 0, 0], [0, 0, 1], [0, 1, 0], [0, -1, 0], [1, 0, 0], [0, 0, -1]], dtype=float)
    return any(free.reach(place + offset, free.home, 0.2 * approach_m) is not None for offset in offsets)


def _out_of_reach(key: str, place: Array, arm: Arm, approach_m: float) -> str:
    low, high = arm.box_low_m, arm.box_high_m
    return (
        f"{key}.position is {place.tolist()}, {np.linalg.norm(place):.2f} m from the base, and the nose of '{arm.name}' cannot come within "
        f"{approach_m:g} m of it. In the arm's base frame the nose may go from ({low[0]:g}, {low[1]:g}, {low[2]:g}) to "
        f"({high[0]:g}, {high[1]:g}, {high[2]:g}) m, as far as the links reach. Type e.g. {key}.position=[0.30,0.10,0.15]."
    )
