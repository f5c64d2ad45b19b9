"""CSV tables at full precision, written line by line."""

import csv
import dataclasses
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

Record = Mapping[str, Any]


class CsvFile:
    """CSV file written line by line, so that what is killed keeps its finished trials."""

    def __init__(self, path: Path, fields: Iterable[str]) -> None:
        self._file = path.open("w", encoding="utf-8", newline="")
        self._writer = csv.DictWriter(self._file, list(fields), lineterminator="\n")
        self._writer.writeheader()

    def add(self, record: Record) -> None:
        """Append one line; a value that is None or missing is left empty."""
        self._writer.writerow(record)
        self._file.flush()

    def close(self) -> None:
        """Close the file."""
        self._file.close()


def write(path: Path, fields: Iterable[str], records: Iterable[Record]) -> None:
    """Write a whole CSV file."""
    sheet = CsvFile(path, fields)
    for record in records:
        sheet.add(record)
    sheet.close()


def names(kind: type) -> list[str]:
    """Return the field names of a dataclass."""
    return [field.name for field in dataclasses.fields(kind)]
