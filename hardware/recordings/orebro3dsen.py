"""Loader of Orebro3DSEN (Burgues et al., Proceedings 2018, 2(13), 911): 27 MOX sensors in a room, one gas release per file, 2 Hz."""

from collections.abc import Mapping
from itertools import product
from typing import Annotated

import numpy as np

from hardware.recordings.data_folder import read_recording
from hardware.recordings.recording_parts import Part, RecordedRows
from oio.core.errors import BadInput
from oio.core.settings import Within, settings
from oio.tabular.layout import find_layout
from oio.tabular.table import Wanted, read_table
from oio.tabular.text import decode


@settings
class Orebro3DSEN:
    """Two runs with one source position: one for calibration, one for the search.

    Sensor C_ijk is at (x_m[i], y_m[j], z_m[k]).
    """

    name: str
    folder: str  # below OIO_DATA
    origin: str  # download address of the files
    calibration: str  # run for `none` (before its release) and `beacon` (after)
    search: str  # run for `source`
    x_m: Annotated[tuple[float, float, float], Within(-1e3, 1e3)]
    y_m: Annotated[tuple[float, float, float], Within(-1e3, 1e3)]
    z_m: Annotated[tuple[float, float, float], Within(-1e3, 1e3)]
    source_m: Annotated[tuple[float, float, float], Within(-1e3, 1e3)]  # source position of both runs
    release_s: Annotated[float, Within(0, 1e6)]  # start of the release, on the file's clock
    settle_s: Annotated[float, Within(0, 1e6)]  # time skipped after that, while the gas spreads
    release_end_s: Annotated[float, Within(0, 1e6)]  # end of the release, on the file's clock

    def check(self) -> None:
        """Refuse times that leave no rows to play."""
        if self.release_s <= 0 or self.settle_s < 0 or self.release_s + self.settle_s >= self.release_end_s:
            raise BadInput(
                f"recording.release_s + settle_s is {self.release_s:g} + {self.settle_s:g} s, but both must come before "
                f"recording.release_end_s={self.release_end_s:g} and release_s must be greater than 0."
            )

    def load(self) -> RecordedRows:
        """Read the calibration run; raises BadInput if it is missing or unusable."""
        return self._read(self.calibration)

    def parse(self, data: bytes, where: str) -> RecordedRows:
        """Return the usable rows of a run's bytes, with `release_s` on the clock of the first; raises BadInput if there are none."""
        names = tuple(f"C_{i}{j}{k} (ppm)" for i, j, k in product(range(3), repeat=3))
        source = decode(data, "mac_roman", where)  # as stated by the authors
        # no value marks saturation, the ppm were computed in their laboratory
        table = read_table(source, find_layout(source, ",", ".", "t (s)"), Wanted("t (s)", float, names, len(names)))
        place_m = np.array(list(product(self.x_m, self.y_m, self.z_m)))
        release_s = self.release_s - table.start_s
        columns = tuple(name.removesuffix(" (ppm)") for name in names)
        return RecordedRows(where, table.t_s, table.values, place_m, np.array(self.source_m), release_s, table.dropped, columns)

    def parts(self) -> Mapping[str, Part]:
        """Return the parts: clean air before the release, then the beacon; the search has a run of its own."""
        clean = self.load()
        return {"none": Part(clean, until_s=clean.release_s), "beacon": self._gas(clean), "source": self._gas(self._read(self.search))}

    def _gas(self, run: RecordedRows) -> Part:
        ends_s = run.release_s + self.release_end_s - self.release_s
        return Part(run, run.release_s + self.settle_s, ends_s, run.source_m)

    def _read(self, run: str) -> RecordedRows:
        file = f"{self.folder}/{run}"
        return self.parse(read_recording(file, self.origin), file)
