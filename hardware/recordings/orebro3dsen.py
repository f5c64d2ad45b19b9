"""Orebro3DSEN (Burgues et al., Proceedings 2018, 2(13), 911): 27 MOX sensors in a room, one gas release per file, 2 Hz."""

from collections.abc import Mapping
from itertools import product

import numpy as np

from hardware.recordings.data_folder import read_recording
from hardware.recordings.delimited_text import TextFormat, read_table
from hardware.recordings.recording_parts import Part, RecordedRows
from oio.core.errors import BadInput
from oio.core.settings import settings


@settings
class Orebro3DSEN:
    """Two runs with one source place: one to calibrate with, one to search in.

    Sensor C_ijk hangs at (x_m[i], y_m[j], z_m[k]).
    """

    name: str
    folder: str  # below OIO_DATA
    origin: str  # where the files can be had
    calibration: str  # the run for `none` (before its release) and `beacon` (after)
    search: str  # the run for `source`
    x_m: tuple[float, float, float]
    y_m: tuple[float, float, float]
    z_m: tuple[float, float, float]
    source_m: tuple[float, float, float]  # of both runs
    release_s: float  # when gas begins, on the file's clock
    settle_s: float  # left out after that, while the gas spreads
    release_end_s: float  # when gas ends, on the file's clock

    def check(self) -> None:
        """Refuse times that leave nothing to play."""
        if self.release_s <= 0 or self.settle_s < 0 or self.release_s + self.settle_s >= self.release_end_s:
            raise BadInput(
                f"recording.release_s + settle_s is {self.release_s:g} + {self.settle_s:g} s, but both must come before "
                f"recording.release_end_s={self.release_end_s:g} and release_s must be greater than 0."
            )

    def load(self) -> RecordedRows:
        """Read the calibration run; raises BadInput if it is missing or cannot be used."""
        return self._read(self.calibration)

    def parse(self, data: bytes, where: str) -> RecordedRows:
        """The usable rows of a run's bytes; raises BadInput if there are none. `release_s` is moved to the clock of the first."""
        names = tuple(f"C_{i}{j}{k} (ppm)" for i, j, k in product(range(3), repeat=3))
        # mac_roman as the authors say; no value marks saturation, the ppm were computed in their laboratory
        table = read_table(data, TextFormat("mac_roman", ",", "t (s)", float, names, saturated=np.inf), where)
        place_m = np.array(list(product(self.x_m, self.y_m, self.z_m)))
        release_s = self.release_s - table.start_s
        return RecordedRows(where, table.t_s, table.values, place_m, np.array(self.source_m), release_s, table.dropped)

    def parts(self) -> Mapping[str, Part]:
        """Clean air before the release, then the beacon; the search has a run of its own."""
        clean = self.load()
        return {"none": Part(clean, until_s=clean.release_s), "beacon": self._gas(clean), "source": self._gas(self._read(self.search))}

    def _gas(self, run: RecordedRows) -> Part:
        ends_s = run.release_s + self.release_end_s - self.release_s
        return Part(run, run.release_s + self.settle_s, ends_s, run.source_m)

    def _read(self, run: str) -> RecordedRows:
        file = f"{self.folder}/{run}"
        return self.parse(read_recording(file, self.origin), file)
