"""Output folder of a benchmark, never shared with another, and its CSV tables at full precision."""

import csv
import dataclasses
import datetime
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from oio.core.errors import BadInput

Record = Mapping[str, Any]


def claim_folder(out: str, command: str, files: tuple[str, ...]) -> Path:
    """Return the folder `out`, or a new one below outputs/ if it is `null`; raises BadInput if it already holds results."""
    now = datetime.datetime.now().astimezone()  # folder name, as Hydra makes them; no result depends on it
    folder = Path(out) if out != "null" else Path("outputs") / f"{now:%Y-%m-%d}" / f"{now:%H-%M-%S-%f}_{command}"
    taken = next((folder / name for name in files if (folder / name).exists()), None)
    if taken is not None:
        raise BadInput(f"{taken} is there already, and results are never overwritten. Give another folder, e.g. out={folder}_2.")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        given = f"out={out} was given, but no folder can be made there ({error.strerror})"
        raise BadInput(f"{given}. Type e.g. out=outputs/{command}.") from None
    return folder


class CsvFile:
    """CSV file written line by line, so that a killed benchmark keeps its finished trials."""

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
