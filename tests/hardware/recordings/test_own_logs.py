"""Ten dirty logs, each of a kind that laboratories publish: surveyed, mapped, played. What is counted, and the values that come out."""

import math
from dataclasses import dataclass
from pathlib import Path

import pytest
from hydra.utils import instantiate
from omegaconf import OmegaConf

from hardware.backends.recording import Recording
from hardware.recordings.csv_file import CsvFile
from oio.core.errors import BadInput
from oio.core.records import Event, GasReading, GasSample
from oio.inspect.survey import survey
from oio.kinematics.arm import Arm
from oio.tabular.mapping import open_mapping

CSV = Path(__file__).resolve().parents[3] / "conf" / "recording" / "csv.yaml"


@dataclass(frozen=True)
class Plain:
    """A sensor of one element whose raw value is ppm."""

    name: str = "plain"
    elements: int = 1
    sample_s: float = 1.0
    tau_rise_s: float = 1.0
    tau_fall_s: float = 1.0
    settled_ppm_per_min: float = 1.0
    highest_raw: float = math.inf

    def reading(self, sample):
        return GasReading(sample.t_ns, sample.element, sample.raw, 1.0)

    def raw(self, ppm):
        return ppm


def loader(**keys: object) -> CsvFile:
    return instantiate({**OmegaConf.load(CSV), "file": "my.csv", **keys}, _convert_="all")


@pytest.fixture(scope="module")
def arm(built) -> Arm:
    return built("arm")


@pytest.fixture
def played(arm, tmp_path):
    """Play a file's bytes by a mapping: seconds, ppm, and the remarks in the log."""

    def play(data: bytes, **keys: object):
        path = tmp_path / "my.csv"
        path.write_bytes(data)
        with Recording(recording=loader(file=str(path), **keys), sensor=Plain(), arm=arm).open() as world:
            samples = list(world.samples(world._playback.length_s))
        gas = [sample for sample in samples if isinstance(sample, GasSample)]
        said = " / ".join(sample.text for sample in samples if isinstance(sample, Event))
        return [sample.t_ns / 1e9 for sample in gas], [sample.raw for sample in gas], said

    return play


def found(data: bytes, **keys: object):
    return survey(data, open_mapping(**keys), "my.csv")


def refused(data: bytes, match: str, **keys: object) -> None:
    with pytest.raises(BadInput, match=match):
        loader(**keys).parse(data)


def test_decimal_commas(played):
    """A German spreadsheet: semicolons, commas, a date with the day first."""
    rows = [f"14.09.2025 15:01:{s:02d};{400 + s},5;21,{s}" for s in range(0, 30, 2)]
    data = "\r\n".join(["Zeit;CO2 (ppm);Temperatur (°C)", *rows]).encode("latin-1")
    seen = found(data)
    assert (seen.layout.delimiter, seen.layout.decimal, seen.source.encoding) == (";", ",", "latin-1") and seen.source.line_ends == "CR LF"
    assert seen.mapping.time_unit == "%d.%m.%Y %H:%M:%S" and not seen.open_keys
    t_s, ppm, said = played(data)
    assert t_s[:3] == [0, 2, 4] and ppm[:3] == [400.5, 402.5, 404.5]
    assert "decimal ','" in said and "time: 'Zeit' in %d.%m.%Y %H:%M:%S: 'Zeit' has the day first" in said


def test_utf_16(played):
    """What Excel calls Unicode text: UTF-16 with a byte order mark, tabs."""
    data = "\r\n".join(["time_s\tCO2 [ppm]\tRH [%]\tTemp [°C]", *(f"{s}\t{400 + s}\t45\t21.5" for s in range(8))]).encode("utf-16")
    seen = found(data)
    assert (seen.source.encoding, seen.layout.delimiter) == ("utf-16", "\t") and seen.columns[2].unit == "degC"
    assert seen.mapping.climate_columns == ("Temp [°C]", "RH [%]")
    assert played(data)[:2] == ([*map(float, range(7))], [*map(float, range(400, 407))])
    got = loader().parse(data)
    assert got.climate[0].tolist() == [21.5, 45.0] and got.t_s[-1] == 7
    bare = data[2:]  # and without the mark
    assert found(bare).source.encoding == "utf-16-le" and loader().parse(bare).ppm[3, 0] == 403


def test_lines_that_end_in_cr_alone(played):
    data = "\r".join(["Time;CO2 [ppm]", *(f"2024-10-07 12:41:{s:02d}.5;{s}" for s in range(10)), ""]).encode()
    seen = found(data)
    assert seen.source.line_ends == "CR" and seen.rows == 10 and seen.clocks[0].step == 1.0
    assert played(data)[1] == [*map(float, range(9))]


def test_repeated_headers_after_resets(played):
    """A board that resets begins its clock anew and prints its header again: how long it was off is not in the file."""
    session = ["millis,ethanol_ppm", *(f"{1000 * s},{s}" for s in range(6))]
    data = "\n".join([*session, *session, *session[:-1]]).encode()
    seen = found(data)
    assert seen.other == {"repeated header": 2} and seen.clocks[0].sizes == (6, 6, 5) and set(seen.open_keys) == {"session"}
    refused(data, r"3 sessions.*1: 6 rows, 2: 6 rows, 3: 5 rows.*Type recording.session=1")
    t_s, ppm, said = played(data, session=3)
    assert t_s == [0, 1, 2, 3] and ppm == [0, 1, 2, 3] and "2 repeated header, 12 of another session" in said


def test_millis_overflows(played):
    """millis() has 32 bits: after 49.7 days it goes on at 0. Nothing was reset, so nothing is asked."""
    stamps = [(2**32 - 2500 + 1000 * i) % 2**32 for i in range(8)]
    data = "\n".join(["time_ms,co_ppm", *(f"{t},{i}" for i, t in enumerate(stamps))]).encode()
    seen = found(data)
    assert stamps[2] > stamps[3] and seen.clocks[0].overflows == 1 and seen.clocks[0].sizes == (8,) and not seen.open_keys
    t_s, ppm, said = played(data)
    assert t_s == [*range(7)] and ppm == [*range(7)] and "'time_ms' overflowed 1 times and was carried on" in said


def test_two_clocks(played):
    """The computer's clock and the board's, which runs 0.1 % fast: which of them stamps the readings is not for a program to guess."""
    rows = [f"{1700000000 + 2 * i},{2002 * i},{i}" for i in range(20)]
    data = "\n".join(["host_time,device_ms,co2_ppm", *rows]).encode()
    seen = found(data)
    (pair,) = seen.compared
    assert pair.names == ("host_time", "device_ms") and pair.rate_ppm == pytest.approx(1000.0) and pair.scatter_s < 1e-6
    refused(data, "2 clocks.*Type recording.time=host_time")
    assert played(data, time="host_time")[0][:3] == [0, 2, 4]
    assert played(data, time="device_ms")[0][:3] == [0, 2.002, 4.004]


def test_counts_of_a_converter(played):
    """Raw counts of a 10-bit converter: named, asked for, and played as if they were ppm, or by what 1 ppm is in counts."""
    counts = [512, 530, 525, 540, 560, 580, 600, 1023, 1023, 1023, 1023, 1023, 620, 610]
    data = "\n".join(["t_ms;MQ3", *(f"{100 * i};{value}" for i, value in enumerate(counts))]).encode()
    remarks = " ".join(found(data).columns[0].remarks)
    assert "counts of a 10-bit converter" in remarks and "at its highest value, 1023, for 5 rows in a row" in remarks
    refused(data, "the unit of .*MQ3.* is not certain.*recording.unit=ppm, ppb, %vol, counts")
    t_s, ppm, said = played(data, unit="counts", saturated=1023.0)
    assert ppm == counts[:7] + counts[12:13] and t_s[7] == 1.2 and "5 saturated" in said
    assert played(data, unit="counts", per_ppm=10.0)[1][:2] == [51.2, 53.0]


def test_missing_units(played):
    """A time that may be seconds or milliseconds, and a gas without a unit: both are asked for."""
    data = "\n".join(["t,gas", *(f"{500 * i},{i}.5" for i in range(9))]).encode()
    assert set(found(data).open_keys) == {"time_unit", "unit"}
    refused(data, "the unit of the time column 't' is not certain.*recording.time_unit=s, or ms")
    refused(data, "the unit of .*gas", time_unit="ms")
    assert played(data, time_unit="ms", unit="ppb")[:2] == ([0.5 * i for i in range(8)], [(i + 0.5) / 1000 for i in range(8)])
    assert found(data, time_unit="ms", unit="ppm").open_keys == {}


def test_gaps_and_codes_for_no_value(played):
    """An hour is missing, and a dead sensor says -999: counted, and the code is asked for."""
    minutes = [*range(5), *range(65, 75)]
    values = {1: "-999", 2: "nan", 66: "-999"}
    rows = [f"2024-01-01T{m // 60:02d}:{m % 60:02d}:00Z,{values.get(m, 400 + m)}" for m in minutes]
    data = "\n".join(["timestamp,co2_ppm", *rows]).encode()
    seen = found(data)
    assert (seen.clocks[0].gaps, seen.clocks[0].longest, seen.clocks[0].longest_at) == (1, 61 * 60, 240)
    assert seen.columns[0].others == 1 and "-999 in 2 rows may mean no value" in seen.columns[0].remarks[0]
    refused(data, r"-999 in 2 rows.*Type recording.no_value=\[\[-999,-999\]\]")
    t_s, ppm, said = played(data, no_value=[[-999, -999]])
    assert ppm[:4] == [400, 403, 404, 465] and t_s[:4] == [0, 180, 240, 3900]
    assert "1 not a number, 2 without a sensor; longest gap 3.66e+03 s at 240 s" in said
    refused(data, "2 sessions.*a gap of more than 600 s", no_value=[[-999, -999]], max_gap_s=600.0)
    assert played(data, no_value=[[-999, -999]], max_gap_s=600.0, session=2)[1][:2] == [465, 467]


def test_ragged_rows(played):
    """Power failed in the middle of lines, a comment was typed in, a cell is quoted, NUL bytes are left of a card."""
    rows = [
        "0,1,a",
        "1,2,b",
        "2,",
        "3,4,d,extra",
        "# opened the window",
        '4,"5","e, with a comma"',
        "5\0,6,f",
        "6,7_0,g",
        "7,8,h",
        "7,8,h",
        "3,9,i",
        "8,9,j",
    ]
    data = "\n".join(["Logger 7, firmware 1.2", "time_s,co2_ppm,comment", *rows]).encode()
    seen = found(data)
    assert seen.other == {"short": 2, "long": 1} and seen.layout.preamble == 1
    assert (seen.clocks[0].missing, seen.clocks[0].duplicates, seen.clocks[0].out_of_order) == (1, 1, 1)
    t_s, ppm, said = played(data)
    assert t_s == [0, 1, 4, 7] and ppm == [1, 2, 5, 8]
    assert "dropped 7 of 12 rows: 2 short, 1 long, 2 not a number, 2 out of order" in said


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_a_date_and_a_time_of_day_are_one_clock(played, end):
    rows = [f"2024-03-0{1 + m // 1440},{m // 60 % 24:02d}:{m % 60:02d}:00,{m}" for m in range(1438, 1446)]
    data = end.join(["Date,Time,co2_ppm", *rows]).encode()
    assert found(data).mapping.time == "Date + Time"
    assert played(data)[:2] == ([60.0 * i for i in range(7)], [*map(float, range(1438, 1445))])


def test_midnight_without_a_date_goes_on(played):
    rows = [f"{m // 60 % 24:02d}:{m % 60:02d}:00;{m}" for m in range(1438, 1446)]
    t_s, _, said = played("\n".join(["Uhrzeit;co2_ppm", *rows]).encode())
    assert t_s == [60.0 * i for i in range(7)] and "overflowed 1 times" in said


def test_a_table_without_a_header_is_played_by_number(played):
    data = "\n".join(f"{i} {i + 0.5}" for i in range(9)).encode()
    refused(data, "no column that is named as a time.*column 1.*column 2")
    keys = {"time": "column 1", "time_unit": "s", "columns": ["column 2"], "unit": "ppm"}
    assert played(data, **keys)[:2] == ([*range(8)], [i + 0.5 for i in range(8)])


def test_parquet_is_the_same_table(played):
    pyarrow = pytest.importorskip("pyarrow")
    from pyarrow import parquet

    written = pyarrow.BufferOutputStream()
    parquet.write_table(pyarrow.table({"time_s": [0, 1, 2], "co2_ppm": [1.5, None, 2.5]}), written)
    t_s, ppm, said = played(written.getvalue().to_pybytes())
    assert (t_s, ppm) == ([0], [1.5]) and "1 not a number" in said


@pytest.mark.parametrize(("keys", "said"), [
    ({"delimiter": ";;"}, "one character"), ({"decimal": ":"}, "a point or a comma"), ({"time_unit": "fortnights"}, "fortnights"),
    ({"time_unit": "row"}, "period_s=1"), ({"period_s": 1.0}, "period_s=1"), ({"per_ppm": 0.0}, "per_ppm is 0"),
    ({"session": 0}, "session is 0"), ({"no_value": [[2, 1]]}, "lower end comes first"), ({"columns": []}, "each element needs a column"),
    ({"climate_columns": ["T"]}, "there are two"), ({"max_gap_s": 0.0}, "max_gap_s is 0"),
])  # fmt: skip
def test_keys_that_cannot_be_are_refused(keys, said):
    with pytest.raises(Exception, match=said):
        loader(**keys)


def test_without_a_file_it_is_told_what_to_type():
    with pytest.raises(BadInput, match=r"Type recording\.file=my\.csv"):
        loader(file=None).load()


def test_micrograms_need_the_gas():
    refused(b"time_s,NO2 [ug/m3]\n0,1\n1,2\n", "1913 ug/m3 of NO2")


def test_an_encoding_that_is_none():
    refused(b"time_s,co2_ppm\n0,1\n1,2\n", "encoding is 'klingon'", encoding="klingon")


def test_a_date_that_may_be_american_is_asked_for():
    data = "\n".join(["time,co2_ppm", *(f"03/04/2024 10:00:0{i},{i}" for i in range(5))]).encode()
    refused(data, "whether the day or the month is first.*%d/%m/%Y.*%m/%d/%Y")
    assert loader(time_unit="%m/%d/%Y %H:%M:%S").parse(data).t_s.tolist() == [0, 1, 2, 3, 4]
