"""Mapping of a table: what its columns are. Every key may be null, which means: read it off the file and say so."""

import dataclasses
import difflib
import math
import re
from typing import Annotated

from oio.core.errors import BadInput
from oio.core.settings import Within, settings
from oio.tabular.stamps import stamp

DECIMALS = (".", ",")
LENGTHS = {"m": 1.0, "mm": 1e-3, "cm": 1e-2}  # m
ANGLES = {"rad": 1.0, "deg": math.pi / 180.0}  # rad


@settings
class TableMapping:
    """Keys of a mapping, the same in conf/recording/csv.yaml and in what `python -m oio.inspect` writes."""

    encoding: str | None  # utf-8, utf-16, latin-1...
    delimiter: str | None
    decimal: str | None  # decimal mark, a point or a comma
    time: str | None  # name of the time column
    time_unit: str | None  # s, ms, us, ns, min, h, d, iso, row (numbered rows), or a pattern such as %d.%m.%Y %H:%M:%S
    period_s: Annotated[float | None, Within(1e-3, 1e5)]  # between rows, with time_unit=row
    columns: tuple[str, ...] | None  # one per element
    column_prefix: str  # put before each of `columns`, where the names in the file are long
    unit: str | None  # of the readings; anything but ppm needs per_ppm, or is played as if it were ppm
    per_ppm: Annotated[float | None, Within(1e-9, 1e9)]  # what 1 ppm is in that unit
    saturated: Annotated[float | None, Within(-1e12, 1e12)]  # in that unit: from here on it is the end of the scale
    no_value: Annotated[
        tuple[tuple[float, float], ...] | None, Within(-1e12, 1e12)
    ]  # ranges of readings, ends included, that mean no measurement
    climate_columns: tuple[str, ...] | None  # temperature [degC] and relative humidity [%], or none
    nose_columns: tuple[str, ...] | None  # where the nose was: x, y, z; or
    joint_columns: tuple[str, ...] | None  # positions of the unlocked joints of the arm that carried it, base first
    position_unit: str | None  # of these: m, mm, cm; rad or deg of joints that turn
    where: str | None  # NAME=VALUE: rows of one device, where several write into one table
    max_gap_s: Annotated[float | None, Within(1e-3, 1e9)]  # a longer gap begins a new session
    session: Annotated[int | None, Within(1, 1_000_000)]  # number of the session to read, from 1, where the clock was set back

    def check(self) -> None:
        """Refuse what cannot be, naming the key."""
        if self.delimiter is not None and len(self.delimiter) != 1:
            raise BadInput(f"recording.delimiter is {self.delimiter!r}, but it is one character. Type e.g. recording.delimiter='\";\"'.")
        if self.decimal is not None and self.decimal not in DECIMALS:
            raise BadInput(f"recording.decimal is {self.decimal!r}, but it is a point or a comma. Type recording.decimal='\",\"'.")
        if self.time_unit is not None and self.time_unit != "row":
            stamp(self.time_unit)
        if (self.time_unit == "row") != (self.period_s is not None):
            raise BadInput(
                f"recording.time_unit={self.time_unit or 'null'} with recording.period_s={self.period_s or 'null'} do not go together: "
                f"rows without time stamps need the seconds between two of them, and rows with time stamps have their own. "
                f"Where a row comes each second type recording.time_unit=row recording.period_s=1."
            )
        self._check_lists()
        self._check_positions()

    def _check_lists(self) -> None:
        for low, high in self.no_value or ():
            if low > high:
                raise BadInput(f"recording.no_value has the range [{low:g}, {high:g}], but the lower end comes first.")
        if self.columns is not None and not self.columns:
            raise BadInput("recording.columns is empty, but each element needs a column. Type recording.columns=[NAME], or null to look.")
        if self.climate_columns is not None and len(self.climate_columns) not in (0, 2):
            raise BadInput(
                f"recording.climate_columns has {len(self.climate_columns)} names, but there are two: temperature [degC], humidity [%]."
            )

    @property
    def first_column(self) -> str | None:
        """Full name of the first column of readings; None where it is to be read off the file."""
        return self.column_prefix + self.columns[0] if self.columns else None

    def _check_positions(self) -> None:
        for key in ("columns", "nose_columns", "joint_columns"):
            names = getattr(self, key) or ()
            if len({*names}) < len(names):
                raise BadInput(f"recording.{key} is {list(names)}, but no column can be two of them. Give each name once.")
        if self.nose_columns and self.joint_columns:
            raise BadInput("recording.nose_columns and recording.joint_columns were both given, but a path is one of them. Leave one out.")
        if self.nose_columns and len(self.nose_columns) != 3:
            raise BadInput(f"recording.nose_columns has {len(self.nose_columns)} names, but there are three: x, y, z.")
        if self.position_unit is not None and self.position_unit not in LENGTHS | ANGLES:
            raise BadInput(
                f"recording.position_unit is {self.position_unit!r}, but it can be {', '.join(LENGTHS | ANGLES)}. Type position_unit=m."
            )


def typed(key: str, value: str | tuple[str, ...]) -> str:
    """Return the word for a key as a shell takes it, with quotes where Hydra needs them: recording.time=t, 'recording.time="t (s)"'."""
    names = (value,) if isinstance(value, str) else value
    quoted = [name if re.fullmatch(r"[A-Za-z]\w*", name) else f'"{name}"' for name in names]
    word = f"recording.{key}=" + (quoted[0] if isinstance(value, str) else f"[{','.join(quoted)}]")
    return word if re.fullmatch(r"[\w.=]+", word) else f"'{word}'"


def open_mapping(**given: object) -> TableMapping:
    """Return a mapping in which all is null but what is given. Raises BadInput for a key that does not exist, or a wrong value."""
    keys = [field.name for field in dataclasses.fields(TableMapping)]
    for key in given:
        if key not in keys:
            near = difflib.get_close_matches(key, keys, 1)
            raise BadInput(f"'{key}' is no key of a mapping.{f' The nearest is {near[0]}.' if near else ''} It can be {', '.join(keys)}.")
    try:
        return TableMapping(**{**dict.fromkeys(keys), "column_prefix": "", **given})  # type: ignore[arg-type]
    except BadInput as error:
        raise BadInput(str(error).replace(f"{TableMapping.__name__}.", "recording.")) from None
