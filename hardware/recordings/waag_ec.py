"""Loader of Waag's making-sensor (github.com/waagsociety): 16 electrochemical NO2 cells in a city, one calibrated value per hour."""

from collections.abc import Mapping
from datetime import datetime
from typing import Annotated

from hardware.recordings.data_folder import read_recording
from hardware.recordings.delimited_text import TextFormat, read_table
from hardware.recordings.recording_parts import Part, RecordedRows
from oio.core.settings import Within, settings


@settings
class WaagEc:
    """One summer. Rows in which a chosen cell has no value are dropped; ug/m3 become ppm. Hours are local, with their zone."""

    name: str
    file: str  # below OIO_DATA
    origin: str  # download address of the file
    columns: tuple[str, ...]  # cells, one per element of the alternating pair
    ug_m3_per_ppm: Annotated[float, Within(1e-3, 1e7)]
    saturated_ug_m3: Annotated[float, Within(1e-3, 1e9)]
    warm_up_max_s: Annotated[float, Within(0.1, 1e7)]  # time-outs of the stages, which take them from here
    baseline_max_s: Annotated[float, Within(0.1, 1e7)]

    def load(self) -> RecordedRows:
        """Read the file; raises BadInput if it is missing or unusable."""
        return self.parse(read_recording(self.file, self.origin))

    def parse(self, data: bytes) -> RecordedRows:
        """Return the usable rows of a file's bytes; raises BadInput if there are none."""
        form = TextFormat("utf-8-sig", ",", "localTime", _clock, self.columns, self.saturated_ug_m3)
        table = read_table(data, form, self.file)
        ppm = table.values / self.ug_m3_per_ppm
        return RecordedRows(
            self.file, table.t_s, ppm, place_m=None, source_m=None, release_s=0.0, dropped=table.dropped, columns=self.columns
        )

    def parts(self) -> Mapping[str, Part]:
        """Return the parts: the whole summer, played while no source is presented."""
        return {"none": Part(self.load())}


def _clock(cell: str) -> float:
    stamp = datetime.fromisoformat(cell)
    if stamp.tzinfo is None:
        raise ValueError(f"{cell} has no time zone, so the hour that winter time repeats could not be told")
    return stamp.timestamp()
