"""Loader of co2_measuring (github.com/iljamak): an SCD30 (infrared CO2) in a room whose windows are opened and closed, every 30 s."""

from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Annotated

from hardware.recordings.data_folder import read_recording
from hardware.recordings.delimited_text import TextFormat, read_table
from hardware.recordings.recording_parts import Part, RecordedRows
from oio.core.settings import Within, settings


@settings
class Scd30Windows:
    """One log with NaN rows, values at the end of the scale, and bursts of rows at each event. Position and sources are unknown."""

    name: str
    file: str  # below OIO_DATA
    origin: str  # download address of the file
    columns: tuple[str, ...]  # one per element of the alternating pair
    climate_columns: tuple[str, str]
    saturated_ppm: Annotated[float, Within(1e-3, 1e9)]
    warm_up_max_s: Annotated[float, Within(0.1, 1e7)]  # time-outs of the stages, which take them from here
    baseline_max_s: Annotated[float, Within(0.1, 1e7)]

    def load(self) -> RecordedRows:
        """Read the file; raises BadInput if it is missing or unusable."""
        return self.parse(read_recording(self.file, self.origin))

    def parse(self, data: bytes) -> RecordedRows:
        """Return the usable rows of a file's bytes; raises BadInput if there are none."""
        form = TextFormat("utf-8-sig", ",", "date", _clock, (*self.columns, *self.climate_columns), self.saturated_ppm)
        table, m = read_table(data, form, self.file), len(self.columns)
        return RecordedRows(
            self.file, table.t_s, table.values[:, :m], place_m=None, source_m=None, release_s=0.0, dropped=table.dropped,
            columns=self.columns, climate=table.values[:, m:],
        )  # fmt: skip

    def parts(self) -> Mapping[str, Part]:
        """Return the parts: the whole log, played while no source is presented."""
        return {"none": Part(self.load())}


def _clock(cell: str) -> float:
    # the time stamps have no zone; taken as UTC they do not jump with this machine's summer time
    return datetime.fromisoformat(cell).replace(tzinfo=UTC).timestamp()
