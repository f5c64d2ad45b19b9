"""`python -m oio.identify` on a run and on made-up and real recordings: what it prints, what it writes, what it refuses."""

import csv
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hydra.core.global_hydra import GlobalHydra

from oio.identify.command import main

pytestmark = pytest.mark.long

ROOT = Path(__file__).resolve().parents[3]
DATA = Path(os.environ.get("OIO_DATA", "data"))
real = pytest.mark.skipif(not (DATA / "orebro3dsen").is_dir(), reason="no recordings here: OIO_DATA names no folder that has them")


@pytest.fixture
def identified(capsys):
    """identified("recording=...") is the exit code, what was printed, and what was said of an error."""

    def identify(*words):
        GlobalHydra.instance().clear()
        try:
            code = main([str(word) for word in words])
        except SystemExit as ended:  # of an option that is none: the parser ends, as argparse's does
            code = ended.code
        said = capsys.readouterr()
        return code, said.out, said.err

    return identify


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory):
    """A run in clean air with two minutes of drift record."""
    out = tmp_path_factory.mktemp("runs") / "clean"
    words = ["sensor=ec", "stage=[warm_up,baseline]", "stage.warm_up.drift_record_s=120", f"hydra.run.dir={out}"]
    subprocess.run([sys.executable, "-m", "oio.run", *words, "report=false"], cwd=ROOT, check=True, capture_output=True)
    return out


@pytest.fixture
def made_up(tmp_path, monkeypatch):
    """A recording of 300 s of two units that read a sine of gas, the second 1.1 times as much and 50 ppm more, with noise."""
    rng, t = np.random.default_rng(0), np.arange(300)
    gas, noise = 500.0 + 40.0 * np.sin(t / 20.0), rng.standard_normal((2, 300))
    rows = zip(t.tolist(), (gas + noise[0]).tolist(), (1.1 * gas + 50.0 + noise[1]).tolist(), strict=True)
    text = "\n".join(f"2024-10-07T12:{i // 60:02d}:{i % 60:02d};{a};{b}" for i, a, b in rows)
    (tmp_path / "made.csv").write_text(f"Time;Concentration [ppm] at VYU;Concentration [ppm] at 21kv\n{text}\n")
    monkeypatch.setenv("OIO_DATA", str(tmp_path))
    return "recording=co2_scd30x4", "recording.file=made.csv"


def rows_of(path):
    with path.open(encoding="utf-8", newline="") as file:
        return {(row["element"], row["quantity"]): row for row in csv.DictReader(file)}


def test_a_recording_is_told_in_80_columns_and_written_with_all_digits(identified, made_up, tmp_path):
    code, out, err = identified(*made_up, "--out", tmp_path / "found.csv")
    assert code == 0, err
    assert max(map(len, out.splitlines())) <= 80 and "95 % interval" in out and "\x1b" not in out
    found = rows_of(tmp_path / "found.csv")
    gain, offset = found["21kv", "gain / VYU"], found["21kv", "offset - VYU"]
    assert float(gain["value"]) == pytest.approx(1.1, abs=0.01) and float(gain["low"]) < float(gain["value"]) < float(gain["high"])
    assert float(offset["value"]) == pytest.approx(100.0, abs=1.5)
    assert float(found["VYU", "noise"]["value"]) == pytest.approx(1.7, abs=0.4)
    assert found["VYU", "K"]["unit"] == "ppm/sqrt(s)" and found["VYU", "warm-up tau"]["value"] == ""


def test_json_has_a_schema_and_the_same_rows(identified, made_up, tmp_path):
    assert identified(*made_up, "--out", tmp_path / "found.json")[0] == 0
    found = json.loads((tmp_path / "found.json").read_text(encoding="utf-8"), parse_constant=pytest.fail)
    assert found["schema"] == "oio.identify/1" and "dropped 0 of 300 rows" in found["about"]
    assert {"element", "quantity", "value", "low", "high", "unit", "note"} == set(found["rows"][0])


def test_two_calls_write_the_same(identified, made_up, tmp_path):
    files = [tmp_path / name for name in ("a.csv", "b.csv")]
    assert [identified(*made_up, "--out", file)[0] for file in files] == [0, 0]
    assert files[0].read_bytes() == files[1].read_bytes()


def test_one_element_alone_has_no_twin(identified, made_up):
    code, out, _ = identified(*made_up, "--element", "21kv")
    assert code == 0 and "gain" not in out and "VYU" not in out


def test_the_bout_rule_is_chosen_as_for_a_run(identified, made_up):
    assert "bout=paper, k=11" in " ".join(identified(*made_up)[1].split())
    assert "bout=cusum, k=7" in " ".join(identified(*made_up, "bout=cusum", "dof=3")[1].split())


def test_a_run_is_identified_from_its_clean_air(identified, run_folder):
    code, out, err = identified(run_folder)
    assert code == 0, err
    assert "stages warm_up, baseline" in " ".join(out.split()) and "ec 0" in out and "ec 1" in out
    assert "needs" in out and "for +-20 %" in out  # two minutes do not tell K
    assert identified(run_folder / "run.mcap", "--stage", "all")[0] == 0
    code, out, _ = identified(run_folder, "--stage", "baseline")  # five readings tell nothing, and that is the answer
    assert code == 0 and "5 readings of clean air are too few" in " ".join(out.split())


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["nowhere"], "there is no such file"),
        (["bout=cusum"], "no recording. Type e.g."),
        (["recording=x"], "recording can be airscout32"),
        (["recording=airscout32", "recording.columns=[a]"], "no column"),
        (["a", "b"], "one run or one recording"),
        (["recording=airscout32", "--element", "C"], "there is"),
        (["recording=airscout32", "--step", "5:1"], "BEGIN:END"),
        (["recording=airscout32", "--out", "found.txt"], ".csv or .json"),
        (["recording=airscout32", "--what"], "unrecognized arguments"),
        ([], "required: WHAT"),
    ],
)
def test_bad_input_is_one_paragraph_that_says_what_to_type(identified, words, said, tmp_path, monkeypatch):
    rows = "\n".join(f"{1000 * t},2025-09-14,{400 + t % 7},{50 - t % 5}" for t in range(60))
    (tmp_path / "airscout32").mkdir()
    (tmp_path / "airscout32" / "session_A_20250914_150134.csv").write_text(f"Timestamp,Date,Gas1,Gas2\n{rows}\n")
    monkeypatch.setenv("OIO_DATA", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    code, out, err = identified(*words)
    assert code == 2 and out == "" and said in err and err.count("\n") == 1


def test_a_stage_that_is_not_there_and_a_file_that_is_are_refused(identified, run_folder, tmp_path, made_up):
    assert "it has warm_up, baseline" in identified(run_folder, "--stage", "navigate")[2]
    (tmp_path / "old.csv").write_text("")
    assert "never overwritten" in identified(*made_up, "--out", tmp_path / "old.csv")[2]
    assert "mkdir" in identified(*made_up, "--out", tmp_path / "no" / "new.csv")[2]


@real
def test_the_drift_of_64_hours_has_no_floor(identified, tmp_path):
    assert identified("recording=sgp30_64h", "recording.unit=ticks", "--out", tmp_path / "drift.csv")[0] == 0
    found = rows_of(tmp_path / "drift.csv")
    for element in ("Ethanol", "H2"):
        assert found[element, "B"]["value"] == "" and "no flat floor" in found[element, "B"]["note"]
        assert 2.0 < float(found[element, "K"]["value"]) < 4.0 and found[element, "K"]["unit"] == "ticks/sqrt(s)"


@real
def test_of_27_sensors_the_noisy_one_is_flagged(identified):
    code, out, _ = identified("recording=orebro3dsen")
    flagged = [line for line in out.splitlines() if "noisier than the others" in line]
    assert code == 0 and len(flagged) == 1 and flagged[0].startswith("- C_102 noise:")


@real
def test_a_window_that_opens_is_a_step(identified, tmp_path):
    """The room's CO2 falls by ventilation within minutes; the sensor's own lag of 20 s is in it."""
    words = "recording=scd30_windows", "--step", "48000:50400", "--gas", "49303", "--out", tmp_path / "step.csv"
    assert identified(*words)[0] == 0
    found = rows_of(tmp_path / "step.csv")
    assert 250.0 < float(found["co2", "tau, fall"]["low"]) < float(found["co2", "tau, fall"]["high"]) < 600.0
    assert float(found["co2", "dead time, fall"]["low"]) < 20.0 < float(found["co2", "dead time, fall"]["high"]) + 20.0
