"""Loader of SmellNet (github.com/MIT-MI/SmellNet): metal oxide sensors over food, raw counts in rows without time stamps, about 1 Hz."""

import re
from collections.abc import Mapping
from typing import Annotated

from hardware.recordings.data_folder import read_recording
from hardware.recordings.delimited_text import TextFormat, read_table
from hardware.recordings.recording_parts import Part, RecordedRows
from oio.core.settings import Within, settings

ROW = "row number"  # the column that takes the place of time stamps


@settings
class SmellNet:
    """One session, in raw counts that are played as if they were ppm. Rows are numbered, so that a dropped row leaves its gap."""

    name: str
    file: str  # below OIO_DATA
    origin: str  # download address of the file
    columns: tuple[str, ...]  # one per element of the alternating pair
    climate_columns: tuple[str, str]
    period_s: Annotated[float, Within(1e-3, 1e5)]  # between rows
    saturated_counts: Annotated[float, Within(1, 1e12)]
    warm_up_max_s: Annotated[float, Within(0.1, 1e7)]  # time-outs of the stages, which take them from here
    baseline_max_s: Annotated[float, Within(0.1, 1e7)]

    def load(self) -> RecordedRows:
        """Read the file; raises BadInput if it is missing or unusable."""
        return self.parse(read_recording(self.file, self.origin))

    def parse(self, data: bytes) -> RecordedRows:
        """Return the usable rows of a file's bytes; raises BadInput if there are none."""
        form = TextFormat("utf-8", ",", ROW, self._stamp, (*self.columns, *self.climate_columns), self.saturated_counts)
        table, m = read_table(_numbered(data), form, self.file), len(self.columns)
        return RecordedRows(
            self.file, table.t_s, table.values[:, :m], place_m=None, source_m=None, release_s=0.0, dropped=table.dropped,
            columns=self.columns, unit="counts", climate=table.values[:, m:],
        )  # fmt: skip

    def parts(self) -> Mapping[str, Part]:
        """Return the parts: the whole session, played while no source is presented."""
        return {"none": Part(self.load())}

    def _stamp(self, cell: str) -> float:
        return float(cell) * self.period_s


def _numbered(data: bytes) -> bytes:
    """Lines with their number in a column of its own; the first line is the header."""
    lines = [line for line in re.split(r"[\r\n]+", data.decode("utf-8-sig", errors="replace")) if line.strip()]
    return "\n".join(f"{ROW if i == 0 else i},{line}" for i, line in enumerate(lines)).encode()
