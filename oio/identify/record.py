"""The record that is identified: readings of each element over time, and what stands beside them."""

from dataclasses import dataclass

import numpy as np

from oio.core.errors import BadInput
from oio.core.records import Array


@dataclass(frozen=True, slots=True, eq=False)
class ElementReadings:
    """Readings value (n,) of one element at t_s (n,) s."""

    name: str
    t_s: Array
    value: Array

    def between(self, begin_s: float, end_s: float) -> "ElementReadings":
        """Return the readings with begin_s <= t < end_s."""
        inside = (self.t_s >= begin_s) & (self.t_s < end_s)
        return ElementReadings(self.name, self.t_s[inside], self.value[inside])


@dataclass(frozen=True, slots=True, eq=False)
class Approaches:
    """The nose before a known source: range_m (n,) m and reading (n,) ppm above clean air, sampled together every period_s."""

    period_s: float
    range_m: Array
    ppm: Array


@dataclass(frozen=True, slots=True, eq=False)
class Record:
    """Readings of m elements in clean air, in `unit`.

    `climate` is temperature [degC] and humidity [%], (n, 2), at the readings of the elements, which then have one time each. `about` says
    where it comes from, `caution` what the numbers cannot mean.
    """

    elements: tuple[ElementReadings, ...]
    unit: str
    about: str
    caution: str
    climate: Array | None = None
    approaches: Approaches | None = None

    def only(self, names: list[str]) -> "Record":
        """Return the record of these elements; raises BadInput for one that is not there."""
        known = [element.name for element in self.elements]
        unknown = [name for name in names if name not in known]
        if unknown:
            raise BadInput(f"--element {unknown[0]} was given, but there is {', '.join(known)}. Type --element {known[0]}.")
        kept = tuple(element for element in self.elements if element.name in names)
        return Record(kept, self.unit, self.about, self.caution, self.climate, self.approaches)

    def side_by_side(self) -> Array:
        """Readings (n, m) of all elements as they are, each at its own times; the last ones of those that have more are left out."""
        n = min(len(element.value) for element in self.elements)
        return np.stack([element.value[:n] for element in self.elements], axis=1)

    def together(self) -> Array:
        """Readings (n, m) of all elements at the times of the first: the others, read in turn, are interpolated."""
        first = self.elements[0]
        return np.stack([np.interp(first.t_s, element.t_s, element.value) for element in self.elements], axis=1)
