"""What a loader gives: the usable rows of one file, and the parts of a recording that play while a source is presented."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf
from typing import Protocol, runtime_checkable

import numpy as np

from oio.core.records import Array


@dataclass(frozen=True, slots=True, eq=False)
class RecordedRows:
    """The usable rows of one file; k rows of m columns, one column per element or, where places are known, per sensor.

    Raises ValueError if the shapes do not agree.
    """

    name: str
    t_s: Array  # (k,) s since the first usable row, strictly rising
    ppm: Array  # (k, m) ppm
    place_m: Array | None  # (m, 3) m, where each column's sensor hung; None: one fixed place nobody wrote down
    source_m: Array | None  # (3,) m, where gas was released; None: unknown
    release_s: float  # when the release began, on the clock of `t_s`; 0 if there was none
    dropped: Mapping[str, int]  # reason -> rows

    def __post_init__(self) -> None:
        k, m = self.ppm.shape
        shapes = (self.t_s.shape == (k,), self.place_m is None or self.place_m.shape == (m, 3))
        if not all(shapes) or (self.source_m is not None and self.source_m.shape != (3,)):
            raise ValueError(f"{self.name}: ppm is {self.ppm.shape}, so t_s must be ({k},), place_m ({m}, 3) and source_m (3,)")

    @property
    def account(self) -> str:
        """One sentence on what was dropped and why, and where the recording is silent longest."""
        lost = sum(self.dropped.values())
        reasons = ", ".join(f"{count} {reason}" for reason, count in self.dropped.items())
        said = f"{self.name}: dropped {lost} of {lost + len(self.t_s)} rows" + (f": {reasons}" if reasons else "")
        gaps = np.diff(self.t_s)
        longest = int(np.argmax(gaps))
        return f"{said}; longest gap {gaps[longest]:.3g} s at {self.t_s[longest]:.0f} s"


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """The stretch of a recording from `from_s` up to, not including, `until_s`, on the clock of its `t_s`."""

    recorded: RecordedRows
    from_s: float = 0.0
    until_s: float = inf
    source_m: Array | None = None  # (3,) m, the source that is active in this stretch; None: none or unknown


@runtime_checkable
class Loader(Protocol):
    """A recording in some format. Building one reads nothing."""

    @property
    def name(self) -> str:
        """As typed after `recording=`."""
        ...

    def load(self) -> RecordedRows:
        """Read the file (the one for calibration, if there are several); raises BadInput if it cannot be used."""
        ...

    def parts(self) -> Mapping[str, Part]:
        """Read all files: for each source that can be presented (`none`, `beacon`, `source`), the part that plays meanwhile."""
        ...
