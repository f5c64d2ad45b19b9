"""What the columns of a table are, read off their names and values. Whatever is not certain is refused with what to type."""

from collections.abc import Mapping, Sequence

import numpy as np

from oio.core.errors import BadInput
from oio.core.records import Array
from oio.tabular.layout import BOTH, Layout
from oio.tabular.mapping import TableMapping, typed
from oio.tabular.names import GAS_UNITS, UNITS, bare, role_of, squeezed, unit_of

CODES = (-1.0, -99.0, -999.0, -9999.0, 32767.0, 65535.0, 2147483647.0)  # in which firmware says that it has no value
NEAR_ZERO = 0.5  # of the median: where nothing else is below that, a 0 is no measurement
FAR = 3.0  # a code is suspicious if it is further from the next value than so many ranges of the others
NO_GAS = ("time", "temperature", "humidity")  # roles of columns that are no readings
DATES, HOURS = ("date", "datum"), ("time", "uhrzeit", "zeit", "heure")  # two columns of one clock
KNOWN_PER_PPM = {"ppm": 1.0, "ppb": 1e3, "%vol": 1e-4}


def the_time(name: str, layout: Layout) -> str:
    """Return the only column that is named as a time. Raises BadInput if there are several, or none."""
    found = [column for column in layout.names if role_of(column) == "time"]
    if len(found) == 1:
        return found[0]
    if len(found) == 2 and bare(found[0]).lower() in DATES and bare(found[1]).lower() in HOURS:
        return BOTH.join(found)
    if found:
        raise BadInput(
            f"{name} has {len(found)} clocks, {found}, and it is not certain which stamps the readings. "
            f"python -m oio.inspect {name} compares them. Type {typed('time', found[0])}."
        )
    raise BadInput(
        f"{name} has no column that is named as a time; its columns are {list(layout.names)}. Type recording.time=NAME, or, for rows "
        f"without time stamps, recording.time_unit=row recording.period_s=1."
    )


def the_gas(name: str, layout: Layout, unread: Mapping[str, str] | None = None) -> tuple[str, ...]:
    """Return the one or two columns that are named as a gas. Raises BadInput if there are more, or none. `unread`: columns of the file that
    are not among those of `layout` because they hold no numbers, each with one of its cells."""
    found = tuple(column for column in layout.names if role_of(column) == "gas")
    if 1 <= len(found) <= 2:
        return found
    said = f"{len(found)} columns that are named as a gas, {list(found)}" if found else "no column that is named as a gas"
    may_be = found or tuple(column for column in layout.names if role_of(column) not in NO_GAS)
    if not may_be and unread:
        cells = ", ".join(f"'{column}' (e.g. {cell!r})" for column, cell in unread.items())
        raise BadInput(f"{name} has no column of readings: what is in {cells} is no number that is read here. Write plain decimal numbers.")
    example = typed("columns", may_be[-1:]) if may_be else "recording.columns=[NAME]"
    raise BadInput(
        f"{name} has {said}, and it is not certain which are the elements; its columns are {list(layout.names)}. "
        f"Type {example}, one name per element of the sensor."
    )


def refuse_clock(name: str, time: object, columns: Sequence[str]) -> None:
    """Raise BadInput if the column of the time stamps is among those of the readings."""
    if time in columns:
        raise BadInput(f"'{time}' of {name} stamps the rows, so it is no reading. Name another column in recording.columns=[NAME].")


def the_unit(mapping: TableMapping, columns: Sequence[str]) -> tuple[str, float]:
    """Return the unit of the readings and what 1 ppm is in it. Raises BadInput if the names do not say it, or it depends on the gas."""
    units = sorted({unit for column in columns if (unit := unit_of(column)) in GAS_UNITS})
    if mapping.unit is None and len(units) > 1:
        raise BadInput(
            f"the names of {list(columns)} say {units}, and readings have one unit. "
            f"Type {typed('columns', (columns[0],))}, or others of one unit."
        )
    unit = known_unit(mapping.unit) if mapping.unit is not None else units[0] if units else None
    if unit is None:
        raise BadInput(
            f"the unit of {list(columns)} is not certain: no name says it. "
            f"Type recording.unit=ppm, ppb, %vol, counts... (with recording.per_ppm=NUMBER for what 1 ppm is in it)."
        )
    if unit not in GAS_UNITS and mapping.per_ppm is None:
        raise BadInput(
            f"recording.unit is '{mapping.unit}', which is none that is known here ({', '.join(GAS_UNITS)}). Type one of these, or with it "
            f"what 1 ppm is in that unit: recording.per_ppm=NUMBER."
        )
    per_ppm = mapping.per_ppm if mapping.per_ppm is not None else KNOWN_PER_PPM.get(unit)
    if per_ppm is None and unit in ("ug/m3", "mg/m3"):
        raise BadInput(
            f"{unit} become ppm by the molar mass of the gas, which is not in the file. Type recording.per_ppm=NUMBER: at 20 degC and "
            f"1013 hPa 1 ppm is M/24.06 mg/m3, e.g. 1913 ug/m3 of NO2 or 1164 ug/m3 of CO."
        )
    return unit, 1.0 if per_ppm is None else per_ppm


def known_unit(word: str) -> str:
    """Return a unit as it is written here: ppb for PPB, %vol for vol%; one that is not known as it is."""
    return UNITS.get(squeezed(word), word)


def climate(layout: Layout) -> tuple[str, ...]:
    """Return the columns of temperature [degC] and relative humidity [%] if there is just one of each, else none."""
    warm = [column for column in layout.names if role_of(column) == "temperature" and unit_of(column) in (None, "degC")]
    humid = [column for column in layout.names if role_of(column) == "humidity"]
    return (warm[0], humid[0]) if len(warm) == len(humid) == 1 else ()


def codes(values: Array) -> dict[float, int]:
    """Return the values of a column (k,) that look like codes for no measurement, each with how often it occurs."""
    finite = values[np.isfinite(values)]
    others = finite[~np.isin(finite, CODES)]
    if not len(others):
        return {}
    reach = FAR * max(float(np.ptp(others)), 1.0)
    near = [(code, int(np.count_nonzero(finite == code))) for code in CODES]
    return {code: count for code, count in near if count and (code < others.min() - reach or code > others.max() + reach)} | _zero(finite)


def _zero(finite: Array) -> dict[float, int]:
    """0, if it occurs among values (k,) none of which comes near: below half of what most of them are."""
    zeros, others = int(np.count_nonzero(finite == 0.0)), finite[finite != 0.0]
    return {0.0: zeros} if zeros and len(others) and others.min() > NEAR_ZERO * np.median(others) > 0.0 else {}
