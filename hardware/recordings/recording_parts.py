"""Data of a loader: the usable rows of one file, and the parts of a recording that play while a source is presented."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from math import inf
from typing import Protocol, runtime_checkable

import numpy as np

from oio.core.errors import BadInput
from oio.core.interfaces import Sensor
from oio.core.records import Array


@dataclass(frozen=True, slots=True, eq=False)
class RecordedRows:
    """Usable rows of one file: k rows of m columns, one column per element or, where positions are known, per sensor.

    Raises ValueError if the shapes do not agree.
    """

    name: str
    t_s: Array  # (k,) s since the first usable row, strictly increasing
    ppm: Array  # (k, m) ppm
    place_m: Array | None  # (m, 3) m, position of each column's sensor; None: one fixed position, not documented
    source_m: Array | None  # (3,) m, position of the release; None: unknown
    release_s: float  # start of the release, on the clock of `t_s`; 0 if there was none
    dropped: Mapping[str, int]  # reason -> rows
    columns: tuple[str, ...] = ()  # (m,) names of the columns in the file
    unit: str = "ppm"  # of `ppm`, where the file holds something else that is played as if it were ppm
    notes: tuple[str, ...] = ()  # what of the mapping was read off the file
    guessed: bool = False  # whether `columns` are all that look like gas, and nobody has named them
    climate: Array | None = None  # (k, 2) temperature [degC] and relative humidity [%] beside the readings; None: not recorded

    def __post_init__(self) -> None:
        k, m = self.ppm.shape
        shapes: tuple[bool, ...] = (self.t_s.shape == (k,), self.place_m is None or self.place_m.shape == (m, 3))
        shapes += (not self.columns or len(self.columns) == m, self.climate is None or self.climate.shape == (k, 2))
        if not all(shapes) or (self.source_m is not None and self.source_m.shape != (3,)):
            raise ValueError(f"{self.name}: ppm is {self.ppm.shape}, t_s must be ({k},), place_m ({m}, 3), source_m (3,), climate ({k}, 2)")

    @property
    def account(self) -> str:
        """Summary of the dropped rows by reason and of the longest gap, as a sentence."""
        lost = sum(self.dropped.values())
        reasons = ", ".join(f"{count} {reason}" for reason, count in self.dropped.items())
        summary = f"{self.name}: dropped {lost} of {lost + len(self.t_s)} rows" + (f": {reasons}" if reasons else "")
        gaps = np.diff(self.t_s)
        longest = int(np.argmax(gaps))
        return f"{summary}; longest gap {gaps[longest]:.3g} s at {self.t_s[longest]:.0f} s"


def measured(recorded: RecordedRows, sensor: Sensor) -> RecordedRows:
    """Return the rows but those in which an element that is played has the sensor's sign for no measurement (`sensor.no_value`), which are
    counted. Raises BadInput if less than two are left."""
    is_no_value: Callable[[float], bool] | None = getattr(sensor, "is_no_value", None)  # a sensor of one's own may have no such values
    if is_no_value is None or not getattr(sensor, "no_value", True):
        return recorded
    played = recorded.ppm if recorded.place_m is not None else recorded.ppm[:, : sensor.elements]
    without = np.array([any(is_no_value(sensor.raw(ppm)) for ppm in row) for row in played.tolist()])
    if not np.any(without):
        return recorded
    reason, kept = f"without a measurement (sensor.no_value of {sensor.name})", ~without
    if np.count_nonzero(kept) < 2:
        value = float(played[np.flatnonzero(without)[0]].min())
        raise BadInput(
            f"{np.count_nonzero(without)} of {len(without)} rows of {recorded.name} are {value:g}, which is how sensor '{sensor.name}' "
            f"says that it has no measurement (sensor.no_value): one that is dead answers so. Give another recording, or its own sensor."
        )
    climate = None if recorded.climate is None else recorded.climate[kept]
    dropped = {**recorded.dropped, reason: int(np.count_nonzero(without))}
    return replace(recorded, t_s=recorded.t_s[kept], ppm=recorded.ppm[kept], climate=climate, dropped=dropped)


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """Interval of a recording from `from_s` up to, not including, `until_s`, on the clock of its `t_s`."""

    recorded: RecordedRows
    from_s: float = 0.0
    until_s: float = inf
    source_m: Array | None = None  # (3,) m, position of the active source in this interval; None: none or unknown


@runtime_checkable
class Loader(Protocol):
    """Protocol of a recording in some format. Creating one reads nothing."""

    @property
    def name(self) -> str:
        """Value of `recording=`."""
        ...

    def load(self) -> RecordedRows:
        """Read the file (the one for calibration, if there are several); raises BadInput if it is unusable."""
        ...

    def parts(self) -> Mapping[str, Part]:
        """Read all files and return, for each source that can be presented (`none`, `beacon`, `source`), the part that plays meanwhile."""
        ...
