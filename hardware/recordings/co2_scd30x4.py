"""Loader: four SCD30 (NDIR) units in one room (github.com/AminDar/CO2-Sensors): polled every 1 s, later 9 s; each updates every 2.06 s."""

from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Annotated

from hardware.recordings.data_folder import read_recording
from hardware.recordings.delimited_text import TextFormat, read_table
from hardware.recordings.recording_parts import Part, RecordedRows
from oio.core.settings import Within, settings


@settings
class Co2Scd30x4:
    """One session of four SCD30. Lines end in CR alone; the units' positions are not documented, so none is known."""

    name: str
    file: str  # below OIO_DATA
    origin: str  # download address of the file
    columns: tuple[str, ...]  # the units that make the alternating pair
    saturated_ppm: Annotated[float, Within(1e-3, 1e9)]
    warm_up_max_s: Annotated[float, Within(0.1, 1e7)]  # time-outs of the stages, which take them from here
    baseline_max_s: Annotated[float, Within(0.1, 1e7)]

    def load(self) -> RecordedRows:
        """Read the file; raises BadInput if it is missing or unusable."""
        return self.parse(read_recording(self.file, self.origin))

    def parse(self, data: bytes) -> RecordedRows:
        """Return the usable rows of a file's bytes; raises BadInput if there are none."""
        columns = tuple(f"Concentration [ppm] at {unit}" for unit in self.columns)
        table = read_table(data, TextFormat("utf-8-sig", ";", "Time", _clock, columns, self.saturated_ppm), self.file)
        return RecordedRows(
            self.file, table.t_s, table.values, place_m=None, source_m=None, release_s=0.0, dropped=table.dropped, columns=self.columns
        )

    def parts(self) -> Mapping[str, Part]:
        """Return the parts: the whole session, played while no source is presented."""
        return {"none": Part(self.load())}


def _clock(cell: str) -> float:
    # the time stamps have no zone; taken as UTC they do not jump with this machine's summer time
    return datetime.fromisoformat(cell).replace(tzinfo=UTC).timestamp()
