"""Loader of any log in a text table (CSV and its kind, also Parquet), by a mapping in YAML: a lab's own, or a public one."""

from collections.abc import Mapping
from typing import Annotated

import numpy as np

from hardware.recordings.data_folder import read_recording
from hardware.recordings.recording_parts import Part, RecordedRows
from oio.core.errors import BadInput
from oio.core.settings import Within, settings
from oio.tabular.mapping import TableMapping
from oio.tabular.read import read_mapped


@settings
class CsvFile(TableMapping):
    """One log at one fixed place, played while no source is presented. Source and place are unknown."""

    name: str
    file: str | None  # as it is, or below OIO_DATA
    origin: str  # download address of the file
    warm_up_max_s: Annotated[float, Within(0.1, 1e7)]  # time-outs of the stages, which take them from here
    baseline_max_s: Annotated[float, Within(0.1, 1e7)]

    def load(self) -> RecordedRows:
        """Read the file; raises BadInput if it is missing, unusable, or does not say what the mapping leaves open."""
        if self.file is None:
            raise BadInput(
                f"recording={self.name} has no file. Type recording.file=my.csv; python -m oio.inspect my.csv tells what is in it."
            )
        return self.parse(read_recording(self.file, self.origin, self.first_column))

    def parse(self, data: bytes) -> RecordedRows:
        """Return the usable rows of a file's bytes; raises BadInput if there are none."""
        name = self.file or self.name
        read = read_mapped(data, self, name)
        table, mapping = read.table, read.mapping
        columns = mapping.columns or ()
        values, rest = np.split(table.values, [len(columns)], axis=1)
        return RecordedRows(
            name, table.t_s, values / (mapping.per_ppm or 1.0), place_m=None, source_m=None, release_s=0.0, dropped=table.dropped,
            columns=columns, guessed=self.columns is None, notes=read.notes, unit="ppm" if mapping.per_ppm != 1.0 else mapping.unit or "",
            climate=rest if rest.size else None,
        )  # fmt: skip

    def parts(self) -> Mapping[str, Part]:
        """Return the parts: the whole log, played while no source is presented."""
        return {"none": Part(self.load())}
