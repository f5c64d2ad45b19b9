"""The reader of tables: dirty files are read, what is dropped is counted, resets are told from outliers."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oio.core.errors import BadInput
from oio.tabular.clock import sessions, unwrapped
from oio.tabular.file import file_bytes
from oio.tabular.layout import find_layout
from oio.tabular.mapping import open_mapping, typed
from oio.tabular.names import role_of, unit_of
from oio.tabular.read import read_mapped
from oio.tabular.table import Table, Wanted, read_table
from oio.tabular.text import decode


def read(text: str, encoding: str = "utf-8-sig", columns: tuple[str, ...] = ("a", "b")) -> Table:
    source = decode(text.encode(encoding), encoding, "made up")
    return read_table(source, find_layout(source, ",", ".", "t"), Wanted("t", float, columns, len(columns), 40000.0))


def table(*rows: str) -> Table:
    return read("\n".join(["t,a,b", *rows]))


@pytest.mark.parametrize("line_end", ["\r", "\n", "\r\n", "\r\r\n"])
def test_any_line_end_and_any_preamble(line_end):
    text = line_end.join(["Session: A", "", '"t" , a,b', "5,1,2", '"', "6,3,4", ""])
    got = read(text)
    assert got.t_s.tolist() == [0, 1] and got.values.tolist() == [[1, 2], [3, 4]]
    assert got.start_s == 5 and got.dropped == {"short": 1}


def test_every_reason_is_counted():
    bad = ["end,true,3", "1,2", "1,2,3,4", "1,nan,3", "1,x,3", "x,2,3", "1,inf,3", "1,2,40000", "1,2,4294967295", "1e300,2,3", "1,-1e300,3"]
    got = table("0,1,1", *bad, "2,1,1", "0,1,1", "3,1,1")
    assert got.t_s.tolist() == [0, 2, 3]
    assert list(got.dropped) == [
        "repeated", "short", "long", "not a number", "too large for a measurement", "without a time", "without a sensor", "saturated",
        "out of order",
    ]  # fmt: skip
    assert list(got.dropped.values()) == [1, 1, 1, 4, 1, 1, 1, 1, 1]


def test_one_wild_stamp_costs_one_row():
    assert table("0,0,0", "9999,1,1", "1,2,2", "2,3,3").values[:, 0].tolist() == [0, 2, 3]


def test_mac_roman_and_a_commented_header():
    got = read("# t,T (°)\n0,1\n1,2\n", encoding="mac_roman", columns=("T (°)",))
    assert got.values.tolist() == [[1], [2]]


@given(st.lists(st.integers(0, 30), min_size=2, max_size=40))
def test_rows_kept_and_dropped_are_all_the_rows_there_were(stamps):
    try:
        got = table(*(f"{t},1,1" for t in stamps))
    except BadInput:
        assert stamps == sorted(stamps, reverse=True)  # no two of them rise
        return
    assert np.all(np.diff(got.t_s) > 0) and len(got.t_s) + sum(got.dropped.values()) == len(stamps)


@given(st.lists(st.integers(0, 10**6), min_size=2, max_size=40, unique=True), st.integers(0, 10**6))
def test_rising_stamps_lose_nothing_and_the_clock_does_not_matter(stamps, shift):
    plain, moved = (table(*(f"{t + by},2,1" for t in sorted(stamps))) for by in (0, shift))
    assert not plain.dropped and len(plain.t_s) == len(stamps)
    np.testing.assert_array_equal(plain.t_s, moved.t_s)


@pytest.mark.parametrize(("stamps", "expected"), [
    ([0, 1, 2, 3, 4], [0, 0, 0, 0, 0]),
    ([5, 6, 7, 0, 1, 2], [0, 0, 0, 1, 1, 1]),  # reset
    ([0, 1, 9999, 2, 3, 4], [0, 0, 0, 0, 0, 0]),  # one wild stamp
    ([0, 1, 3, 2, 4, 5], [0, 0, 0, 0, 0, 0]),  # two rows changed places
    ([5, 6, 7, 0, 1], [0, 0, 0, 0, 0]),  # too few rows to tell: they are dropped as out of order
    ([0, 0, 0, 1, 1], [0, 0, 0, 0, 0]),
])  # fmt: skip
def test_resets_are_told_from_outliers(stamps, expected):
    assert sessions(np.array(stamps, dtype=float)).tolist() == expected


def test_a_long_gap_begins_a_session_and_only_with_a_limit():
    stamps = np.array([0.0, 1.0, 100.0, 101.0])
    assert sessions(stamps, 10.0).tolist() == [0, 0, 1, 1] and sessions(stamps).tolist() == [0, 0, 0, 0]


@given(st.integers(0, 10**6), st.integers(3, 30))
def test_an_overflow_changes_nothing(first, rows):
    whole = first + 7.0 * np.arange(rows)
    carried, times = unwrapped(whole % 150.0, 150.0)
    np.testing.assert_allclose(np.diff(carried), 7.0)
    assert times == int(whole[-1] // 150 - whole[0] // 150)


def test_a_reset_is_no_overflow():
    stamps = np.array([0.0, 1.0, 2.0, 0.0, 1.0, 2.0])
    assert unwrapped(stamps, 4294967.296)[1] == 0


@pytest.mark.parametrize(("data", "said"), [
    (b"", "0 lines"), (b"one line", "1 lines"), (b"some words\nthat are text\nand no table at all\n", "no table"),
    (bytes(range(256)) * 20, "no text"), (b"PK\x03\x04" + b"x" * 99, "Save the sheet as CSV"),
    (b"t,a\n1,2\n" + b"\0" * 999, "no text"),
])  # fmt: skip
def test_what_is_no_table_is_refused(data, said):
    with pytest.raises(BadInput, match=said):
        read_mapped(data, open_mapping(), "f")


@given(st.binary(max_size=300), st.sampled_from([b"", b"time_s,co2_ppm\n0,1\n1,2\n", b"t;gas\n"]))
def test_random_bytes_are_read_or_refused(data, head):
    try:
        got = read_mapped(head + data, open_mapping(), "f")
    except BadInput:
        return
    assert np.all(np.isfinite(got.table.values)) and np.all(np.diff(got.table.t_s) > 0)


@pytest.mark.parametrize(("text", "said"), [
    ("time_s,co2_ppm\n0,1\n1,2\n", None),
    ("a,b\n0,1\n1,2\n", "no column that is named as a time"),
    ("time_s,x\n0,1\n1,2\n", "no column that is named as a gas"),
    ("time_s,co2,no2,o3\n0,1,1,1\n1,2,2,2\n", "3 columns that are named as a gas"),
    ("time_s;co2_ppm\n0;1,5\n1;2.5\n2;1,5\n", "which is the decimal mark"),
    ("t;a|b\n0;1|2\n1;1|2\n", "certain which"),
])  # fmt: skip
def test_what_is_not_certain_is_asked(text, said):
    if said is None:
        assert read_mapped(text.encode(), open_mapping(), "f").table.values.tolist() == [[1], [2]]
        return
    with pytest.raises(BadInput, match=said):
        read_mapped(text.encode(), open_mapping(), "f")


@pytest.mark.parametrize(("name", "role", "unit"), [
    ("CO2 [ppm]", "gas", "ppm"), ("co2_ppm_b", "gas", "ppm"), ("Concentration [ppm] at VYU", "gas", "ppm"), ("mq3_adc", "gas", "counts"),
    ("Temperature (°C)", "temperature", "degC"), ("T", "temperature", None), ("t (s)", "time", "s"), ("millis", "time", "ms"),
    ("Rel. Humidity", "humidity", None), ("q1_deg", "joint", "deg"), ("nose_x_mm", "nose", "mm"), ("comment", None, None),
])  # fmt: skip
def test_names_tell_what_a_column_holds(name, role, unit):
    assert (role_of(name), unit_of(name)) == (role, unit)


def test_the_word_to_type_is_quoted_as_a_shell_and_hydra_want_it():
    assert typed("time", "t") == "recording.time=t" and typed("time", "t (s)") == "'recording.time=\"t (s)\"'"
    assert typed("columns", ("a", "b 1")) == "'recording.columns=[a,\"b 1\"]'"


def test_a_file_that_cannot_be_read(tmp_path):
    path = tmp_path / "a.parquet"
    path.write_bytes(b"PAR1 and no more")
    with pytest.raises(BadInput, match="cannot be read"):
        file_bytes(path)


def mapped(text: str, **keys: object):
    return read_mapped(text.encode(), open_mapping(**keys), "made up")


@pytest.mark.parametrize(("text", "said"), [
    ('"t [s]","co2 [ppm]"\n0,998\n1,999\n2,"1,012"\n3,"1,013"\n', "values such as 1,012 in 'co2 [ppm]' beside whole numbers up to 999"),
    ("t [s];co2 [ppm]\n0;998\n1;999\n2;1.012\n3;1.013\n", "recording.decimal='\".\"'"),
    ('"t [ms]","co2 [ppm]"\n0,998\n"2,000",999\n"4,000",997\n', "values such as 2,000 in 't [ms]'"),
    ("t [s];co2 [ppm]\n0;998\n1;999\n2;1'012\n3;1'013\n", "values such as 1'012 in 'co2 [ppm]', with marks between thousands"),
    ("t [s];co2 [ppm]\n0;998,5\n1;999,5\n2;1.012,5\n3;1.013,5\n", "values such as 1.012,5"),
])  # fmt: skip
def test_marks_between_thousands_are_not_taken_for_decimals(text, said):
    with pytest.raises(BadInput) as refused:
        mapped(text)
    assert said in str(refused.value)


@pytest.mark.parametrize(("text", "keys", "values"), [
    ("t [s];u [V]\n0;1.012\n1;2.125\n2;0.998\n", {"unit": "V"}, [1.012, 2.125, 0.998]),  # three decimals throughout
    ("t [s];co2 [ppm]\n0;998\n1;1000.5\n2;1.125\n", {}, [998, 1000.5, 1.125]),
    ("t [s];co2 [ppm]\n0;998\n1;999\n2;1.012\n", {"decimal": "."}, [998, 999, 1.012]),  # as the user says
    ("t [s];x [V]\n0;1\n1;1.125\n2;2\n", {"unit": "V"}, [1, 1.125, 2]),  # whole numbers, but small ones
])  # fmt: skip
def test_decimals_are_not_taken_for_thousands(text, keys, values):
    assert mapped(text, columns=(text.split("\n")[0].split(";")[1],), **keys).table.values[:, 0].tolist() == values


def test_a_header_with_its_columns_in_another_order_is_refused():
    rows = "time_s,co2_ppm,temp_C\n0,420,21\n1,421,21\n"
    again = mapped(rows + "time_s,co2_ppm,temp_C\n2,422,21\n").table
    assert again.values[:, 0].tolist() == [420, 421, 422] and again.dropped == {"repeated header": 1}
    with pytest.raises(BadInput, match="names its columns again in row 3 below its header, and otherwise"):
        mapped(rows + "time_s,temp_C,co2_ppm\n2,21,422\n")


def test_a_repeated_header_with_two_equal_names_is_the_same_header():
    rows = "time_s,co2_ppm,co2_ppm\n0,420,421\n1,421,422\n"
    for again in ("time_s,co2_ppm,co2_ppm\n", "time_s, co2_ppm, co2_ppm\n"):
        assert len(mapped(rows + again + "2,422,423\n").table.t_s) == 3


@pytest.mark.parametrize(("unit", "ppm"), [("PPB", 0.42), ("vol%", 4.2e6), ("%vol", 4.2e6), ("ppm", 420.0)])
def test_a_unit_is_known_in_any_of_its_spellings(unit, ppm):
    read = mapped("t [s],gas\n0,420\n1,421\n", columns=("gas",), unit=unit)
    assert read.table.values[0, 0] / read.mapping.per_ppm == pytest.approx(ppm)


@pytest.mark.parametrize("unit", ["pmm", "%", "percent", "mol/l"])
def test_a_unit_that_is_not_known_needs_what_1_ppm_is_in_it(unit):
    text = "t [s],gas\n0,420\n1,421\n"
    with pytest.raises(BadInput, match="none that is known here"):
        mapped(text, columns=("gas",), unit=unit)
    assert mapped(text, columns=("gas",), unit=unit, per_ppm=2.0).mapping.per_ppm == 2.0


@pytest.mark.parametrize(("name", "unit"), [("co2 [mg/m³]", "mg/m3"), ("co2 [Vol.-%]", "%vol"), ("r [kΩ]", "kohm"), ("r [Ω]", "ohm")])
def test_units_with_signs_of_print_are_known(name, unit):
    assert unit_of(name) == unit


def test_a_column_that_is_not_there_is_answered_with_those_that_are():
    text = "Logger 3, room 12\nt [s],co2 [ppm],note\n0,420,a\n1,421,b\n2,422,c\n"
    with pytest.raises(BadInput, match=r"no column \['CO'\]. Its columns are \['t \[s\]', 'co2 \[ppm\]', 'note'\]"):
        mapped(text, columns=("CO",))


def test_columns_of_two_units_are_not_read_as_one():
    with pytest.raises(BadInput, match=r"readings have one unit\. Type 'recording\.columns="):
        mapped("t [s],eco2_ppm,tvoc_ppb\n0,420,10\n1,421,11\n")


def stamped(cells, name="time"):
    """read_mapped of rows with these time stamps, whose readings count up from 400 ppm."""
    return mapped(f"{name};co2_ppm\n" + "\n".join(f"{cell};{400 + i}" for i, cell in enumerate(cells)) + "\n")


@pytest.mark.parametrize(("cells", "unit"), [
    ([f"{12 if i < 60 else 1:02d}:{i % 60:02d}:30 PM" for i in range(90)], "%I:%M:%S %p"),
    ([f"{11 + i // 60}:{i % 60:02d}:00{'AM' if i < 60 else 'PM'}" for i in range(90)], "%I:%M:%S%p"),
    ([f"03/13/2024 {2 + i // 60}:{i % 60:02d} pm" for i in range(90)], "%m/%d/%Y %I:%M %p"),
    ([f"2024-03-13 {2 + i // 60}:{i % 60:02d}:00 PM" for i in range(90)], "%Y-%m-%d %I:%M:%S %p"),
    ([f"{(50 + i) % 60:02d}:07.5" for i in range(90)], "%M:%S.%f"),  # as a spreadsheet shows a full stamp; the hour is lost
    ([f"{30 + i // 2}:{30 * (i % 2):02d}" for i in range(59)], "%M:%S"),
])  # fmt: skip
def test_clocks_of_twelve_hours_and_of_minutes(cells, unit):
    got = stamped(cells)
    assert got.mapping.time_unit == unit and not got.table.dropped
    np.testing.assert_allclose(np.diff(got.table.t_s), 30.0 if unit == "%M:%S" else 60.0)


def test_hours_and_minutes_may_be_minutes_and_seconds():
    with pytest.raises(BadInput, match=r"holds '00:00', and it is not certain whether that is hours and minutes"):
        stamped([f"00:{i:02d}" for i in range(60)])


@pytest.mark.parametrize(("name", "unit"), [("ms", "ms"), ("us", "us"), ("seconds", "s"), ("date_time", "iso")])
def test_names_of_times_that_are_a_unit(name, unit):
    cells = [f"2024-01-01 10:00:{i:02d}" if unit == "iso" else str(1000 * i) for i in range(20)]
    assert stamped(cells, name).mapping.time_unit == unit


def test_the_newest_row_first_is_turned_round_and_told():
    got = stamped([str(t) for t in range(50, 0, -1)], "time_s")
    assert got.table.values[:, 0].tolist() == list(range(449, 399, -1)) and not got.table.dropped
    assert "rows: the newest is first, so they were turned round" in got.notes


@pytest.mark.parametrize(("stamps", "said"), [
    ([i // 10 for i in range(100)], r"90 of 100 rows repeat the time stamp .*recording.time_unit=row recording.period_s=0.1,"),
    ([i // 2 for i in range(100)], "50 of 100 rows repeat the time stamp"),
    ([i * 37 % 101 for i in range(1, 101)], "are in no order of time, .* Sort the file by its time"),
    ([1000 * (i % 2) + i for i in range(100)], "several devices write into one table"),
])  # fmt: skip
def test_a_clock_that_would_lose_most_rows_is_refused(stamps, said):
    with pytest.raises(BadInput, match=f"has a time column 'time_s', but .*{said}"):
        stamped(map(str, stamps), "time_s")


def test_lists_in_a_parquet_file_are_left_out_and_structures_are_columns(tmp_path):
    pyarrow, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    places = [{"x": 0.1 * i, "y": 0.0} for i in range(3)]
    table = pyarrow.table({"time_s": [0.0, 1.0, 2.0], "co2_ppm": [400.0, 401.0, 402.0], "spectrum": [[1, 2]] * 3, "place": places})
    parquet.write_table(table, tmp_path / "a.parquet")
    head = file_bytes(tmp_path / "a.parquet").decode().splitlines()[0]
    assert head == '"time_s","co2_ppm","place.x","place.y"'


@pytest.mark.parametrize("text", [
    "t [s];co2 [ppm]\n" + "\n".join(f"{i};1.{400 + i}" for i in range(20)),
    't [s],co2 [ppm]\n' + "\n".join(f'{i},"1,{400 + i}"' for i in range(20)),
])  # fmt: skip
def test_thousands_alone_are_not_taken_for_thousandths(text):
    with pytest.raises(BadInput, match=r"values such as 1.419 in 'co2 \[ppm\]', all with three digits behind the mark"):
        mapped(text)
    told = mapped(text, decimal="," if '"' in text else ".")
    assert told.table.values[0, 0] == 1.4


@pytest.mark.parametrize("rows", [
    [f"{i};12.{100 + i};21.5" for i in range(20)],  # another column says what the point is
    [f"{i};412.{100 + i};21" for i in range(20)],  # not 412 thousand
    [f"{i};0.{100 + i};21" for i in range(20)],
])  # fmt: skip
def test_three_decimals_are_decimals_where_something_says_so(rows):
    assert not mapped("t [s];co2 [ppm];T\n" + "\n".join(rows)).table.dropped


def test_a_row_that_was_cut_by_the_end_of_the_file_is_dropped_and_counted():
    rows = [f"{i},{400 + i}" for i in range(20)]
    assert mapped("t [s],co2 [ppm]\n" + "\n".join([*rows, "20,4"])).table.dropped == {"cut at the end of the file": 1}
    for end in ("20,4\n", "20,411", "20,4111"):
        assert not mapped("t [s],co2 [ppm]\n" + "\n".join([*rows, end])).table.dropped


DEVICES = [f"{i};{'AB'[i % 2]};{(400, 900)[i % 2] + i}" for i in range(60)]


@pytest.mark.parametrize("name", ["sensor_id", "channel", "entity_id", "sensor", "device_id", "node_name"])
def test_rows_of_several_devices_are_read_of_one(name):
    text = f"t_s;{name};co2_ppm\n" + "\n".join(DEVICES) + "\n"
    with pytest.raises(BadInput, match=rf"rows of 2 devices, by its column '{name}' \(A, B\).*recording.where=\"{name}=A\""):
        mapped(text)
    got = mapped(text, where=f"{name}=B")
    assert got.table.values[:, 0].tolist() == [900 + i for i in range(1, 60, 2)] and got.table.dropped == {"of another device": 30}


@pytest.mark.parametrize(("text", "where"), [
    ("t_s;sensor;T\n" + "\n".join(f"{i};{400 + i % 9};21" for i in range(60)), None),  # readings, called so
    ("t_s;device_id;co2_ppm\n" + "\n".join(f"{i};A;{400 + i}" for i in range(60)), None),  # one device
    ("t_s;note;co2_ppm\n" + "\n".join(f"{i};{i % 2};{400 + i}" for i in range(60)), None),
])  # fmt: skip
def test_one_device_is_not_asked_for(text, where):
    assert len(mapped(text, unit="ppm", where=where).table.t_s) == 60


@pytest.mark.parametrize(
    ("where", "said"), [("A", "it is a column and its value"), ("colour=A", "no column"), ("sensor_id=C", "0 usable rows")]
)
def test_a_device_that_is_not_there_is_refused(where, said):
    with pytest.raises(BadInput, match=said):
        mapped("t_s;sensor_id;co2_ppm\n" + "\n".join(DEVICES) + "\n", where=where)
