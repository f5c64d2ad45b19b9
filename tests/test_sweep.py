"""`-m`: every job in a directory of its own; one that fails does not stop the others; a bad choice stops all before they begin."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
from hydra.core.global_hydra import GlobalHydra

from oio.cli.hydra_errors import known_error
from oio.cli.sweep_check import refuse_bad_choices
from oio.core.folders import CONF
from oio.log import read_metadata
from oio.sweep.job_table import show_sweep
from oio.sweep.manifest import Job, Outcome

pytestmark = pytest.mark.long

ROOT = Path(__file__).resolve().parents[1]
TINY = ("stage=[warm_up,baseline]", "cache=off")


def sweep(folder, *words):
    line = [sys.executable, "-m", "oio.run", "-m", *words, f"hydra.sweep.dir={folder}"]
    return subprocess.run(line, cwd=ROOT, capture_output=True, text=True, timeout=300, check=False)


def status(path):
    return json.loads((path / "status.json").read_text(encoding="utf-8"))


def refusal(*words):
    """What the command would say of the sweep before its first job; nothing if nothing is wrong."""
    GlobalHydra.instance().clear()
    try:
        refuse_bad_choices(["-m", *words])
    except Exception as error:
        return str(known_error(error, CONF))
    finally:
        GlobalHydra.instance().clear()
    return ""


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    """Two sensors by two seeds, in parallel."""
    folder = tmp_path_factory.mktemp("sweeps") / "good"
    return sweep(folder, "hydra/launcher=joblib", "hydra.launcher.n_jobs=2", "sensor=ndir,pa", "seed=0,1", *TINY), folder


@pytest.fixture(scope="module")
def mixed(tmp_path_factory):
    """One after the other: the first job has no time to settle, the second has."""
    folder = tmp_path_factory.mktemp("sweeps") / "mixed"
    return sweep(folder, "sensor=ndir", "stage.warm_up.max_s=0.2,60", *TINY), folder


def test_every_job_has_its_own_directory(good):
    done, folder = good
    assert done.returncode == 0
    assert re.fullmatch(r"4 jobs to run, about 12 MB at most of the .* GB that are left\n(.*jobs have ended.*\n)*", done.stderr)
    jobs = sorted(path for path in folder.iterdir() if path.is_dir())
    assert [path.name for path in jobs] == ["0_ndir_5dof_seed0", "1_ndir_5dof_seed1", "2_pa_5dof_seed0", "3_pa_5dof_seed1"]
    for path in jobs:
        assert {**status(path), "started": ""} == {"state": "done", "error": None, "traceback": None, "started": ""}
        assert {"run.mcap", "calibration.yaml", "config.yaml", "status.json", "summary.json"} == {file.name for file in path.iterdir()}


def test_every_job_is_what_its_name_says(good):
    for path in (path for path in good[1].iterdir() if path.is_dir()):
        about, summary = read_metadata(path / "run.mcap"), json.loads((path / "summary.json").read_text(encoding="utf-8"))
        told = f"_{about['sensor']}_{about['dof']}dof_seed{about['seed']}"
        assert path.name.endswith(told)
        assert (summary["sensor"], str(summary["seed"])) == (about["sensor"], about["seed"])


def test_one_table_over_all_jobs(good):
    done, folder = good
    assert done.stdout.count(f"4 jobs, {folder}") == 1
    for name in ("0_ndir_5dof_seed0", "1_ndir_5dof_seed1", "2_pa_5dof_seed0", "3_pa_5dof_seed1"):
        line = next(line for line in done.stdout.splitlines() if name in line)
        assert "done" in line
    assert "\x1b" not in done.stdout


def test_the_table_says_what_each_job_was(good):
    line = next(line for line in good[0].stdout.splitlines() if "3_pa_5dof_seed1" in line)
    assert [cell.strip() for cell in line.strip("│").split("│")][1:6] == ["pa", "still", "done", "5", "1"]


def test_a_failure_leaves_its_traceback_and_the_others_go_on(mixed):
    _, folder = mixed
    failed, finished = status(folder / "0_ndir_5dof_seed0"), status(folder / "1_ndir_5dof_seed0")
    assert finished["state"] == "done"
    assert failed["state"] == "failed"
    assert "readings per element came" in failed["error"] and "raise stage.warm_up.max_s." in failed["error"]
    assert failed["traceback"].startswith("Traceback") and "NotSettled" in failed["traceback"] and "warm_up.py" in failed["traceback"]
    assert not (folder / "0_ndir_5dof_seed0" / "run.mcap").exists()
    assert (folder / "0_ndir_5dof_seed0" / "run.mcap.part").is_file()


def test_a_failure_is_told_in_the_table_and_by_the_exit_code(mixed):
    done, folder = mixed
    assert done.returncode == 1
    assert done.stderr.endswith("oio: 1 jobs of the sweep failed; their status.json says why.\n")
    lines = done.stdout.splitlines()
    assert any("0_ndir_5dof_seed0" in line and "failed" in line for line in lines)
    assert any("1_ndir_5dof_seed0" in line and "done" in line for line in lines)
    assert f"job 0_ndir_5dof_seed0: {status(folder / '0_ndir_5dof_seed0')['error']}" in done.stdout


def test_the_table_takes_any_text(capsys):
    show_sweep([Outcome(Job(0, (), "0_a"), "failed", "[/red] [bold]x", None)], "here")
    assert "job 0_a: [/red] [bold]x" in capsys.readouterr().out


def test_a_bad_choice_is_refused_before_any_job_runs(tmp_path):
    done = sweep(tmp_path / "refused", "sensor=ec,xx", "seed=0,1")
    expected = "oio: sensor=xx was given, but sensor can be ec, mox_mics, mox_mq, ndir, pa. Type e.g. sensor=ec.\n"
    assert (done.returncode, done.stdout, done.stderr) == (2, "", expected)
    assert not (tmp_path / "refused").exists()


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["seed=range(0,3)", "dof=5,x"], "dof=x was given"),
        (["stage=[warm_up],[navigate]"], "stage 'navigate' needs Calibration"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_every_value_of_a_sweep_is_built_before_it_begins(words, expected):
    assert refusal(*words).startswith(expected)


def test_a_good_sweep_is_not_refused():
    assert refusal("sensor=ec,ndir", "seed=0,1", *TINY) == ""
