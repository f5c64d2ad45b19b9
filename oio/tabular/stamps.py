"""Time stamps: cells to seconds, in whatever unit or notation a logger writes them; and which it is, where that is certain."""

import re
from collections.abc import Callable, Sequence
from datetime import UTC, date, datetime
from itertools import pairwise

from oio.core.errors import BadInput

PER_S = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}
LONGER = {"min": 60.0, "h": 3600.0, "d": 86400.0}
WRAPS = {"ms": 2**32 / 1e3, "us": 2**32 / 1e6}  # s after which millis() and micros() begin anew: 49.7 days, 71.6 minutes
DAY_S, HOUR_S = 86400.0, 3600.0
OF_DAY, OF_HOUR = ", a time of day without a date", ", minutes and seconds, which begin anew each hour"
UNITS = (*PER_S, *LONGER, "iso", "iso_zoned", "row")
DAY_FIRST = re.compile(r"(\d{1,2})([./-])(\d{1,2})\2(\d{4}|\d{2})[ T]\d{1,2}:\d{2}(:\d{2}(\.\d+)?)?( ?[AaPp][Mm])?$")
DIGITS, OF_DIGITS = (
    re.compile(r"20\d{12}"),
    "%Y%m%d%H%M%S",
)  # a date and a time without marks: a count of s, ms or us is never in that range
TWO_PARTS = re.compile(r"(\d{1,2}):\d{2}$")
NOTATIONS = {  # with what is said of them
    "iso": "", "%Y-%m-%d %H:%M:%S UTC": "", "%Y/%m/%d %H:%M:%S": "", "%Y/%m/%d %H:%M": "",
    "%Y-%m-%d %I:%M:%S %p": "", "%Y-%m-%d %I:%M %p": "",
    "%H:%M:%S.%f": OF_DAY, "%H:%M:%S": OF_DAY, "%I:%M:%S %p": OF_DAY, "%I:%M:%S%p": OF_DAY, "%I:%M %p": OF_DAY,
    "%H:%M": OF_DAY, "%M:%S.%f": OF_HOUR, "%M:%S": OF_HOUR,
}  # fmt: skip
UNIX_S = (1.2e9, 2.5e9)  # years 2008 to 2049
SHEET_EPOCH, SHEET_D = date(1899, 12, 30).toordinal(), (36526.0, 54789.0)  # days of a spreadsheet: years 2000 to 2049
SHORT_S = {"s": 90.0, "ms": 900.0, "us": 900.0, "ns": 900.0}  # with longer steps it may as well be the uptime of a board, in a finer unit


def stamp(unit: str, decimal: str = ".") -> Callable[[str], float]:
    """Return the function from a cell to seconds; it raises ValueError. `unit`: one of UNITS, or a pattern such as %d.%m.%Y %H:%M:%S.

    Time stamps without a zone are taken as UTC, so that they do not jump with this machine's summer time. Raises BadInput for another unit.
    """
    if unit in PER_S:
        return lambda cell: float(cell.replace(",", ".") if decimal == "," else cell) / PER_S[unit]
    if unit in LONGER:
        return lambda cell: float(cell.replace(",", ".") if decimal == "," else cell) * LONGER[unit]
    if unit == "iso":
        return lambda cell: _seconds(datetime.fromisoformat(cell.strip(' "').replace(",", ".")))
    if unit == "iso_zoned":
        return _zoned
    if "%" in unit:
        return lambda cell: _seconds(datetime.strptime(cell.strip(' "'), unit))  # noqa: DTZ007
    raise BadInput(
        f"recording.time_unit is '{unit}', but it is {', '.join(UNITS)} or a pattern. Type e.g. recording.time_unit=ms, or "
        f"recording.time_unit='\"%d.%m.%Y %H:%M:%S\"'."
    )


def _zoned(cell: str) -> float:
    at = datetime.fromisoformat(cell.strip(' "'))
    if at.tzinfo is None:
        raise ValueError(f"{cell} has no time zone, so the hour that winter time repeats could not be told")
    return at.timestamp()


def _seconds(at: datetime) -> float:
    return (at if at.tzinfo else at.replace(tzinfo=UTC)).timestamp()


def wrap_s(unit: str) -> float | None:
    """Duration after which a clock of this unit begins anew by itself [s]; None if it does not."""
    if "%" not in unit or any(mark in unit for mark in ("%d", "%j", "%x", "%c")):
        return WRAPS.get(unit)
    return DAY_S if "%H" in unit or "%p" in unit else HOUR_S if "%M" in unit else None


def find_unit(column: str, named: str | None, cells: Sequence[str], decimal: str) -> tuple[str, str]:
    """Return the unit of a time column and the reason for it. `named`: the unit that its name says; `cells`: some of its values.

    Raises BadInput where it is not certain.
    """
    full = [cell.strip(' "') for cell in cells if cell.strip(' "')]
    if not full:
        raise BadInput(f"the time column '{column}' is empty. Type recording.time=NAME for another.")
    numbers = [value for cell in full if (value := _number(cell, decimal)) is not None]
    if len(numbers) < 0.5 * len(full):
        return _notation(column, full)
    if all(DIGITS.fullmatch(cell) for cell in full) and _fits(OF_DIGITS, full):
        return OF_DIGITS, f"'{column}' is written so"
    if named in PER_S or named in LONGER:
        return str(named), f"by the name of '{column}'"
    middle = sorted(numbers)[len(numbers) // 2]
    steps = sorted(b - a for a, b in pairwise(numbers) if b > a)
    for unit, per_s in PER_S.items():
        if UNIX_S[0] < middle / per_s < UNIX_S[1] and steps and steps[len(steps) // 2] / per_s <= SHORT_S[unit]:
            return unit, f"'{column}' counts {unit} since 1970"
    if SHEET_D[0] < middle < SHEET_D[1] and steps and steps[len(steps) // 2] < 1.0:
        day = date.fromordinal(SHEET_EPOCH + int(middle))
        raise BadInput(
            f"the unit of the time column '{column}' is not certain: its name says none, and {middle:.6g} is {day}, if it counts days as "
            f"spreadsheets do. Type recording.time_unit=d if so, else s, ms, us, ns, min or h."
        )
    raise BadInput(
        f"the unit of the time column '{column}' is not certain: its name says none, and {numbers[0]:g}, {numbers[-1]:g} may be s or ms. "
        f"Type recording.time_unit=s, or ms, us, ns, min, h, d."
    )


def _number(cell: str, decimal: str) -> float | None:
    try:
        return float(cell.replace(",", ".") if decimal == "," else cell)
    except ValueError:
        return None


def _notation(column: str, cells: Sequence[str]) -> tuple[str, str]:
    hours = [int(found[1]) for cell in cells if (found := TWO_PARTS.match(cell))]
    if len(hours) > 0.9 * len(cells) and max(hours) < 24:
        raise BadInput(
            f"the time column '{column}' holds {cells[0]!r}, and it is not certain whether that is hours and minutes, or minutes and "
            f"seconds. Type recording.time_unit='\"%H:%M\"' or recording.time_unit='\"%M:%S\"'."
        )
    for unit, said in NOTATIONS.items():
        if _fits(unit, cells):
            return unit, f"'{column}' is written so{said}"
    dated = [found for cell in cells if (found := DAY_FIRST.match(cell))]
    if len(dated) < 0.9 * len(cells):
        raise BadInput(
            f"the time column '{column}' holds {cells[0]!r}, which is read in no known way. "
            f"Type recording.time_unit='\"%d.%m.%Y %H:%M:%S\"'."
        )
    first, second = max(int(found[1]) for found in dated), max(int(found[3]) for found in dated)
    mark, year = dated[0][2], "%Y" if len(dated[0][4]) == 4 else "%y"
    noon = dated[0][7] or ""
    clock = ("%I:%M" if noon else "%H:%M") + (":%S" if dated[0][5] else "") + (".%f" if dated[0][6] else "")
    clock += f"{' ' if noon.startswith(' ') else ''}%p" if noon else ""
    day, month = f"%d{mark}%m{mark}{year} {clock}", f"%m{mark}%d{mark}{year} {clock}"
    if mark == "." or first > 12:
        return day, f"'{column}' has the day first"
    if second > 12:
        return month, f"'{column}' has the month first"
    raise BadInput(
        f"the time column '{column}' holds {cells[0]!r}, and it is not certain whether the day or the month is first. "
        f"Type recording.time_unit='\"{day}\"' or recording.time_unit='\"{month}\"'."
    )


def _fits(unit: str, cells: Sequence[str]) -> bool:
    convert, good = stamp(unit), 0
    for cell in cells:
        try:
            convert(cell)
        except ValueError:
            continue
        good += 1
    return good >= 0.9 * len(cells)
