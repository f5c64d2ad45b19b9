"""Loader of AirScout32 (github.com/callmewire/AirScout32): SCD40 and MiCS-5524 side by side in one room, a row about every 11 s."""

from collections.abc import Mapping
from typing import Annotated

from hardware.recordings.data_folder import read_recording
from hardware.recordings.delimited_text import TextFormat, read_table
from hardware.recordings.recording_parts import Part, RecordedRows
from oio.core.settings import Within, settings


@settings
class AirScout32:
    """One session of AirScout32. Position and sources are unknown.

    Gas1 is CO2 in ppm. Gas2 is a MiCS index relative to its own baseline, dimensionless: it is played as if it were ppm,
    so its drift and its noise are real, and its level has no meaning.
    """

    name: str
    file: str  # below OIO_DATA
    origin: str  # download address of the file
    columns: tuple[str, ...]  # one per element of the alternating pair
    saturated_ppm: Annotated[float, Within(1e-3, 1e9)]
    warm_up_max_s: Annotated[float, Within(0.1, 1e7)]  # time-outs of the stages, which take them from here
    baseline_max_s: Annotated[float, Within(0.1, 1e7)]

    def load(self) -> RecordedRows:
        """Read the file; raises BadInput if it is missing or unusable."""
        return self.parse(read_recording(self.file, self.origin))

    def parse(self, data: bytes) -> RecordedRows:
        """Return the usable rows of a file's bytes; raises BadInput if there are none."""
        form = TextFormat("utf-8-sig", ",", "Timestamp", _milliseconds, self.columns, self.saturated_ppm)
        table = read_table(data, form, self.file)
        return RecordedRows(
            self.file, table.t_s, table.values, place_m=None, source_m=None, release_s=0.0, dropped=table.dropped, columns=self.columns
        )

    def parts(self) -> Mapping[str, Part]:
        """Return the parts: the whole session, played while no source is presented."""
        return {"none": Part(self.load())}


def _milliseconds(cell: str) -> float:
    return float(cell) / 1000.0
