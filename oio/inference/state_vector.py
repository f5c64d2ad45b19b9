"""What is in the state of the filter: blocks in their order, names and units.

x = (o (n) rad | v (n) rad/s | a (n) rad/s^2 | s (3) m | l | n | k (3) 1/m | u 1/m | b (E) ppm | f (P) ppm | m (P))

o, v, a: encoder offset of each joint with its rate and acceleration (the paper's drift is quadratic); s, l: source and ln strength;
n, k, u: exponent, wind and thinning of the range law; b: offsets of the E elements; f: lagged concentration; m: relative fluctuation, at
each of the P distinct places of the elements.
"""

from functools import cached_property

from oio.gas.range_law import LAW
from oio.kinematics.arm import Arm

LAW_NAMES = ("source_x", "source_y", "source_z", "ln_strength", "exponent", "wind_x", "wind_y", "wind_z", "thinning")
LAW_UNITS = ("m", "m", "m", "1", "1", "1/m", "1/m", "1/m", "1/m")


class StateVector:
    """Layout of the state for an arm and a sensor with so many gains as elements."""

    arm: Arm
    gain: tuple[float, ...]

    @property
    def elements(self) -> int:
        """Number of sensor elements."""
        return len(self.gain)

    @cached_property
    def place_of(self) -> tuple[int, ...]:
        """Index of the place of each element."""
        return self.arm.place_of(self.elements)

    @property
    def places(self) -> int:
        """Number of distinct places of the elements."""
        return max(self.place_of) + 1

    @cached_property
    def size(self) -> int:
        """Length of the state."""
        return 3 * self.arm.dof + LAW + 2 * self.places + self.elements

    @cached_property
    def at(self) -> dict[str, slice]:
        """Slice of each block in the state."""
        n, names, where = self.arm.dof, {}, 0
        sizes = {"o": n, "v": n, "a": n, "s": 3, "l": 1, "n": 1, "k": 3, "u": 1, "b": self.elements, "f": self.places, "m": self.places}
        for block, size in sizes.items():
            names[block] = slice(where, where + size)
            where += size
        return names

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Name of each state."""
        joints = [f"{what}_{joint}" for what in ("offset", "rate", "acceleration") for joint in self.arm.names]
        at = ("",) if self.places == 1 else tuple(f"_{i}" for i in range(self.places))
        gas = *(f"lagged{i}" for i in at), *(f"fluctuation{i}" for i in at)
        return (*joints, *LAW_NAMES, *(f"baseline_{e}" for e in range(self.elements)), *gas)

    @cached_property
    def units(self) -> tuple[str, ...]:
        """Unit of each state."""
        joints = [unit + per for per in ("", "/s", "/s^2") for unit in self.arm.units]
        return (*joints, *LAW_UNITS, *["ppm"] * (self.elements + self.places), *["1"] * self.places)
