"""`python -m oio.inspect`: 80 columns, YAML that plays, one paragraph and code 2 for what is no table."""

import json
from pathlib import Path

import numpy as np
import pytest
import yaml
from hydra.utils import instantiate
from omegaconf import OmegaConf

from oio.inspect.__main__ import main
from oio.inspect.columns import column_of, runs
from oio.tabular.mapping import open_mapping

CONF = Path(__file__).resolve().parents[3] / "conf" / "recording"
ROWS = "\n".join(f"{500 * i},{i},{400 + i},21.5,45" for i in range(40))
TEXT = f"Logger 3\nmillis,note,co2 A (ppm),T,rh\n{ROWS}\n"


@pytest.fixture
def log(tmp_path):
    path = tmp_path / "my log.csv"
    path.write_text(TEXT, encoding="utf-8")
    return path


def test_the_survey_fits_80_columns_and_counts(log, capsys):
    assert main([str(log)]) == 0
    said = capsys.readouterr().out
    survey = said.split("\n\n")[0]
    assert max(map(len, survey.splitlines())) <= 80
    for words in ("header behind 1", "40, of 5 cells", "'millis' (ms): 40 stamps over 19.5 s, every 0.5 s", "co2 A (ppm)  gas ppm"):
        assert words in survey


def test_the_yaml_plays_as_it_stands(log, tmp_path):
    out = tmp_path / "my.yaml"
    assert main([str(log), "--out", str(out)]) == 0
    keys = {**OmegaConf.load(CONF / "csv.yaml"), **yaml.safe_load(out.read_text(encoding="utf-8"))}
    assert keys.pop("defaults") == ["csv", "_self_"]
    got = instantiate(keys, _convert_="all").load()
    assert got.ppm[:, 0].tolist() == [400 + i for i in range(40)] and got.t_s[1] == 0.5 and got.climate[0].tolist() == [21.5, 45.0]
    assert not any(note.startswith(("time", "columns", "unit", "climate")) for note in got.notes)  # nothing is left to guess


def test_what_is_not_certain_stays_open_until_it_is_told(tmp_path, capsys):
    path = tmp_path / "a.csv"
    path.write_text("t,gas\n" + "\n".join(f"{i},{i}" for i in range(9)), encoding="utf-8")
    assert main([str(path)]) == 0
    said = capsys.readouterr().out
    assert "uncertain  time_unit: " in said and "time_unit: null  # not certain" in said and "unit: null" in said
    assert main([str(path), "time_unit=ms", "recording.unit=ppm"]) == 0
    said = capsys.readouterr().out
    assert "uncertain" not in said and 'time_unit: "ms"' in said and 'unit: "ppm"' in said


@pytest.mark.parametrize(("stamps", "said"), [
    ([i // 10 for i in range(100)], "90 of 100 rows repeat the time stamp before them"),
    ([i * 37 % 101 for i in range(1, 101)], "they are in no order of time"),
])  # fmt: skip
def test_a_clock_that_would_lose_most_rows_is_uncertain(stamps, said, tmp_path, capsys):
    path = tmp_path / "a.csv"
    path.write_text("time_s,co2_ppm\n" + "\n".join(f"{t},{i}" for i, t in enumerate(stamps)), encoding="utf-8")
    assert main([str(path)]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "uncertain time: of 'time_s' " in told and said in told and "time: null # not certain" in told


def test_the_newest_row_first_is_told(tmp_path, capsys):
    path = tmp_path / "a.csv"
    path.write_text("time_s,co2_ppm\n" + "\n".join(f"{50 - i},{i}" for i in range(50)), encoding="utf-8")
    assert main([str(path)]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "50 stamps over 49 s, every 1 s (median)" in told and "the newest row is first" in told and "uncertain" not in told


def test_names_in_a_file_are_never_interpolated_or_obeyed(tmp_path, capsys):
    path, out = tmp_path / "a.csv", tmp_path / "a.yaml"
    name = "co2_${oc.env:HOME}_ppm"
    path.write_text(f"time_s,{name},\x1b[31mred\n0,1,1\n1,2,1\n2,3,1\n", encoding="utf-8")
    assert main([str(path), f"columns={json.dumps([name])}", "--out", str(out)]) == 0
    assert "\x1b" not in capsys.readouterr().out
    assert OmegaConf.to_container(OmegaConf.load(out), resolve=True)["columns"] == [name]


@pytest.mark.parametrize(("content", "words", "said"), [
    (b"no table here", [], "is no table"), (b"\x89PNG\r\n\x1a\n" + bytes(range(256)), [], "is no table"), (None, [], "is no file"),
    (TEXT.encode(), ["colour=red"], "'colour' is no key"), (TEXT.encode(), ["red"], "no KEY=VALUE"),
    (TEXT.encode(), ["session=0"], "session"),
    (TEXT.encode(), ["delimiter=[[["], "no plain YAML"), (TEXT.encode(), ["--out", "{log}"], "exists"),
    (TEXT.encode(), ["--out", "/nowhere/a.yaml"], "cannot be written"),
])  # fmt: skip
def test_what_cannot_be_read_is_one_paragraph_and_code_2(content, words, said, tmp_path, capsys):
    path = tmp_path / "a.csv"
    if content is not None:
        path.write_bytes(content)
    assert main([str(path), *(word.replace("{log}", str(path)) for word in words)]) == 2
    shown = capsys.readouterr()
    assert said in shown.err and shown.err.count("\n") == 1 and shown.out == ""


def test_stuck_saturated_and_constant_stretches_are_told():
    values = np.concatenate((np.arange(50.0), np.full(30, 7.5), np.full(6, 99.0), np.arange(50.0)))
    remarks = " ".join(column_of("gas", values).remarks)
    assert "stuck at 7.5 for 30 rows from row 51" in remarks and "at its highest value, 99, for 6 rows" in remarks
    assert column_of("gas", np.full(9, 1.0)).remarks == ("always the same value",)
    assert column_of("gas", np.full(9, np.nan)).remarks == ("no numbers",)
    starts, lengths = runs(np.array([1.0, 1.0, 2.0, np.nan, np.nan]))
    assert starts.tolist() == [0, 2, 3, 4] and lengths.tolist() == [2, 1, 1, 1]


def test_the_keys_of_a_mapping_are_those_of_the_configuration():
    keys = set(yaml.safe_load((CONF / "csv.yaml").read_text(encoding="utf-8")))
    assert set(vars(open_mapping())) < keys
