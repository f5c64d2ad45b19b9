"""Where a benchmark leaves its tables: a folder that holds no other's, comma-separated values with every digit."""

import csv
import dataclasses
import datetime
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from oio.core.errors import BadInput

Record = Mapping[str, Any]


def claimed(out: str, command: str, files: tuple[str, ...]) -> Path:
    """The folder `out`, or a new one below outputs/ if it is `null`; raises BadInput if it holds a benchmark already."""
    now = datetime.datetime.now().astimezone()  # the name of a folder, as Hydra gives them; no result depends on it
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


class Sheet:
    """A file of comma-separated values that grows line by line, so that a killed benchmark keeps what is done."""

    def __init__(self, path: Path, fields: Iterable[str]) -> None:
        self._file = path.open("w", encoding="utf-8", newline="")
        self._writer = csv.DictWriter(self._file, list(fields), lineterminator="\n")
        self._writer.writeheader()

    def add(self, record: Record) -> None:
        """One line; what is None or missing is empty."""
        self._writer.writerow(record)
        self._file.flush()

    def close(self) -> None:
        """The file is whole."""
        self._file.close()


def write(path: Path, fields: Iterable[str], records: Iterable[Record]) -> None:
    """A whole file."""
    sheet = Sheet(path, fields)
    for record in records:
        sheet.add(record)
    sheet.close()


def names(kind: type) -> list[str]:
    """The fields of a dataclass."""
    return [field.name for field in dataclasses.fields(kind)]
