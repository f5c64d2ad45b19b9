"""Loader of MOX-Compensation-SGP30 (github.com/TUG-EIP): raw signals of an SGP30 (metal oxide) in a lived-in room, 64 h, every 10 s."""

from collections.abc import Mapping
from typing import Annotated

import numpy as np

from hardware.recordings.data_folder import read_recording
from hardware.recordings.recording_parts import Part, RecordedRows
from oio.core.errors import BadInput
from oio.core.settings import Within, settings
from oio.tabular.layout import find_layout
from oio.tabular.table import Wanted, read_table
from oio.tabular.text import decode

TICKS_PER_E_FOLD = 512.0  # Sensirion: ln(c / c_ref) = (s_ref - s) / 512


@settings
class Sgp30:
    """One continuous session. Each sample is repeated in a row that begins with `end`; those are dropped. Position and sources are unknown.

    With unit ppm the raw signals become concentrations relative to a reference; with unit ticks they are left as they are.
    """

    name: str
    file: str  # below OIO_DATA
    origin: str  # download address of the file
    columns: tuple[str, ...]  # raw signals, one per element of the alternating pair
    climate_columns: tuple[str, str]
    unit: str
    reference_ticks: Annotated[tuple[float, ...], Within(1, 65535)]  # s_ref of each column
    reference_ppm: Annotated[tuple[float, ...], Within(1e-6, 1e6)]  # c_ref of each column
    saturated_ticks: Annotated[float, Within(1, 65535)]
    warm_up_max_s: Annotated[float, Within(0.1, 1e7)]  # time-outs of the stages, which take them from here
    baseline_max_s: Annotated[float, Within(0.1, 1e7)]

    def check(self) -> None:
        """Refuse another unit, and references that do not fit the columns."""
        if self.unit not in ("ppm", "ticks"):
            raise BadInput(f"recording.unit is '{self.unit}', but it can be ppm or ticks. Type recording.unit=ppm.")
        if not len(self.columns) == len(self.reference_ticks) == len(self.reference_ppm):
            raise BadInput(f"recording.columns has {len(self.columns)} names; reference_ticks and reference_ppm need as many numbers.")

    def load(self) -> RecordedRows:
        """Read the file; raises BadInput if it is missing or unusable."""
        return self.parse(read_recording(self.file, self.origin))

    def parse(self, data: bytes) -> RecordedRows:
        """Return the usable rows of a file's bytes; raises BadInput if there are none."""
        source, m = decode(data, "utf-8-sig", self.file), len(self.columns)
        wanted = Wanted("time", float, (*self.columns, *self.climate_columns), m, self.saturated_ticks)
        table = read_table(source, find_layout(source, ",", ".", "time"), wanted)
        value = table.values[:, :m]
        if self.unit == "ppm":
            value = np.array(self.reference_ppm) * np.exp(np.clip((np.array(self.reference_ticks) - value) / TICKS_PER_E_FOLD, -50.0, 50.0))
        return RecordedRows(
            self.file, table.t_s, value, place_m=None, source_m=None, release_s=0.0, dropped=table.dropped,
            columns=self.columns, unit=self.unit, climate=table.values[:, m:],
        )  # fmt: skip

    def parts(self) -> Mapping[str, Part]:
        """Return the parts: the whole session, played while no source is presented."""
        return {"none": Part(self.load())}
