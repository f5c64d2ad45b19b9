"""Logs that say what a table says in other words, read to the same numbers as the table; and those that say it in two ways, refused."""

import json

import numpy as np
import pytest

from oio.core.errors import BadInput
from oio.tabular.mapping import open_mapping
from oio.tabular.read import read_mapped

N = 60
T_S, PPM, WARM = range(N), [410.5 + i % 7 for i in range(N)], [21.25 + i % 3 for i in range(N)]
ROWS = list(zip(T_S, PPM, WARM, strict=True))
INFLUX = (
    "#group,false,false,true,false,false\n#datatype,string,long,dateTime:RFC3339,double,string\n#default,_result,,,,\n"
    ",result,table,_time,_value,_field\n"
)


def moment(t):
    return f"2026-05-01T12:{t // 60:02d}:{t % 60:02d}"


FORMS = {
    "pairs": "".join(f"t={1000 * t} co2={c} temp={w}\n" for t, c, w in ROWS),
    "plotter": "".join(f"t:{1000 * t},co2:{c},temp:{w}\n" for t, c, w in ROWS),
    "monitor": "Starting SCD30...\nready\n" + "".join(f"{moment(t)[11:]}.250 -> CO2: {c} ppm, T: {w} C, status: ok\n" for t, c, w in ROWS),
    "commas": "".join(f"t=0,{t:03d} co2={c} temp={w}\n".replace(".", ",") for t, c, w in ROWS),
    "json_lines": "".join(json.dumps({"t_ms": 1000 * t, "air": {"co2_ppm": c, "temp": w}, "note": None}) + "\n" for t, c, w in ROWS),
    "json_array": json.dumps([{"t_ms": 1000 * t, "co2_ppm": c, "temp": w} for t, c, w in ROWS]),
    "json_printed": "[\n" + ",\n".join(json.dumps({"t_ms": 1000 * t, "co2_ppm": c, "temp": w}) for t, c, w in ROWS) + "\n]\n",
    "json_indented": json.dumps([{"t_ms": 1000 * t, "air": {"co2_ppm": c, "temp": w}} for t, c, w in ROWS], indent=2),
    "unit_row": "time,co2,temp\ns,ppm,degC\n" + "".join(f"{t},{c},{w}\n" for t, c, w in ROWS),
    "unit_row_of_dates": "Zeit;CO2;Temp\r\n[YYYY-MM-DD hh:mm:ss];[ppm];[°C]\r\n"
    + "".join(f"{moment(t)};{c};{w}\r\n".replace("T", " ") for t, c, w in ROWS),
    "units": "time,co2,temp\n" + "".join(f"{t} s,{c} ppm,{w} °C\n" for t, c, w in ROWS),
    "units_attached": "time;co2;temp\n" + "".join(f"{t}s;{c}ppm;{w}°C\n".replace(".", ",") for t, c, w in ROWS),
    "influx": INFLUX + "".join(f",,0,{moment(t)}Z,{c},co2\n" for t, c, _ in ROWS),
    "late_header": "".join(f"setting {i}\n" for i in range(40)) + "time_s,co2_ppm\n" + "".join(f"{t},{c}\n" for t, c, _ in ROWS),
}
KNOWN = {
    "influx": {"columns": ("_value",), "unit": "ppm"}, **{k: {"time_unit": "ms", "unit": "ppm"} for k in ("pairs", "plotter", "commas")},
}  # fmt: skip


def read(name, **known):
    return read_mapped(FORMS[name].encode(), open_mapping(**{**KNOWN.get(name, {}), **known}), f"{name}.log")


@pytest.mark.parametrize("name", FORMS)
def test_the_same_numbers(name):
    found = read(name)
    t_s = np.array(T_S) * (1e-6 if name == "commas" else 1.0)
    assert np.allclose(found.table.t_s, t_s, atol=1e-12 if name == "commas" else 1e-6)
    assert np.array_equal(found.table.values[:, 0], PPM)
    assert found.table.dropped == ({"short": 2} if name == "monitor" else {})


def test_what_was_read_as_a_table_is_told():
    assert "lines: values with names" in read("pairs").notes and "lines: JSON" in read("json_array").notes
    assert not any(note.startswith("lines:") for note in read("unit_row").notes)


@pytest.mark.parametrize("name", ["unit_row", "units", "monitor"])
def test_units_are_those_of_the_columns(name):
    mapping = read(name).mapping
    assert mapping.unit == "ppm" and mapping.columns in (("co2 [ppm]",), ("CO2 [ppm]",))
    again = read(name, time=mapping.time, columns=mapping.columns, time_unit=mapping.time_unit, delimiter=mapping.delimiter)
    assert np.array_equal(again.table.values, read(name).table.values)


def test_a_cell_in_another_unit_is_dropped_and_counted():
    text = FORMS["units"].replace("413.5 ppm,22.25", "413500 ppb,22.25")
    found = read_mapped(text.encode(), open_mapping(), "auto.csv")
    assert found.table.dropped == {"not a number": FORMS["units"].count("413.5 ppm,22.25")} != {"not a number": 0}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("".join(f"t_s={t} co2={c} {'ppm' if t < 40 else 'ppb'}\n" for t, c, _ in ROWS), "'co2' in ppm, and from line 41 on in ppb"),
        ("time [s],co2 [ppb]\ns,ppm\n" + "".join(f"{t},{c}\n" for t, c, _ in ROWS), "by its name in ppb, but by the row below in ppm"),
        ("Date,CO2 (ppm)\n" + "".join(f"{46143.5 + t / 86400:.8f},{c}\n" for t, c, _ in ROWS), "46143.5 is 2026-05-01, if it counts days"),
        ("".join(f"name{t}: {t}\n" for t in T_S), "no column that is named as a time"),  # settings, and no measurements
    ],
)
def test_what_is_not_certain_is_refused(text, said):
    with pytest.raises(BadInput, match=said):
        read_mapped(text.encode(), open_mapping(), "my.log")


@pytest.mark.parametrize(
    ("known", "said"),
    [
        ({"time_unit": "row"}, r"need the seconds between two of them.*recording\.period_s=1"),
        ({"time_unit": "row", "period_s": "nan"}, "recording.period_s is 'nan', but it must be a number"),
        ({"time_unit": "row", "period_s": 0}, "recording.period_s is 0, but 0.001 to 100000 is allowed"),
    ],
)
def test_rows_without_stamps_are_told_what_they_need(known, said):
    with pytest.raises(BadInput, match=said):
        open_mapping(**known)


@pytest.mark.parametrize("cell", ['1,0"12', '"a""b'])
def test_a_cell_with_quotes_astray_is_no_row(cell):
    rows = "".join(f"{t},{c}\n" for t, c, _ in ROWS)
    found = read_mapped(f"time_s,co2_ppm\n{rows}60,{cell}\n61,411.5\n".encode(), open_mapping(), "my.csv")
    assert found.table.values[-1, 0] == 411.5 and sum(found.table.dropped.values()) == 1


def test_hostile_lines_are_read_as_they_are():
    for line in ("[" * 5000, "{" * 5000, '{"a": ' * 3000, "=" * 5000, "a=" * 5000, "1" * 5000 + " ppm", "a: " * 2000):
        with pytest.raises(BadInput):
            read_mapped(f"{line}\n{line}\n{line}\n".encode(), open_mapping(), "my.log")
