"""`trials=N`: every trial is the run of its seed, a failure stops no other, and a stop keeps what is done."""

import csv
import json
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from oio.api.simulation import simulate
from oio.bench.trial import composed_trial
from oio.cli import trials as tested
from oio.cli.build import build, reseeded
from oio.cli.compose import compose
from oio.cli.execute import execute
from oio.core.errors import BadInput, OioError

pytestmark = pytest.mark.long

ROOT = Path(__file__).resolve().parents[3]
SHORT = (
    "sensor=ec", "dof=3", "seed=3", "report=false", "stage.navigate.max_moves=12", "stage.map_beliefs.repeats=2",
    "stage.map_beliefs.budget_s=0", "stage.calibrate_bouts.moves_per_rung=2",
)  # fmt: skip


def built(*words):
    composed = compose((*SHORT, *words), ())
    return build(composed.cfg, composed.choices, [*SHORT, *words])


def rows(folder):
    with (folder / "trials.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_every_trial_is_the_run_of_its_seed(tmp_path):
    summary = execute(built("trials=2"), tmp_path / "both", quiet=True)
    alone = [execute(built(f"seed={seed}", "logging=summary"), tmp_path / str(seed), quiet=True) for seed in (3, 4)]
    found = rows(tmp_path / "both")
    assert [(row["seed"], row["verdict"], row["scored"]) for row in found] == [
        (str(run["seed"]), run["verdict"], run["scored"]["word"]) for run in alone
    ]
    for outcome in ("cold", "calibrated", "calibrated_paper_assembly"):
        assert [float(row[f"{outcome}.source_error_m"]) for row in found] == [run[outcome]["source_error_m"] for run in alone]
    errors = [run["calibrated"]["source_error_m"] for run in alone]
    assert summary["calibrated"]["source_error_m"] == pytest.approx(sum(errors) / 2)
    assert summary["seed"] == 3 and summary["dof"] == 3 and summary["distribution"]["trials"] == 2
    assert json.loads((tmp_path / "both" / "summary.json").read_text())["distribution"]["first_seed"] == 3
    assert sorted(path.name for path in (tmp_path / "both").iterdir()) == ["config.yaml", "status.json", "summary.json", "trials.csv"]


def test_a_trial_that_fails_is_told_and_stops_no_other(monkeypatch, tmp_path):
    real = tested.run_in_memory

    def failing(experiment):
        if experiment.seed == 3:
            raise OioError("the sensor died")
        return real(experiment)

    monkeypatch.setattr(tested, "run_in_memory", failing)
    summary = execute(built("trials=2"), tmp_path / "run", quiet=True)
    assert [row["failed"] for row in rows(tmp_path / "run")] == ["the sensor died", ""]
    assert summary["distribution"]["failed"] == {"3": "the sensor died"}
    monkeypatch.setattr(tested, "run_in_memory", lambda experiment: (_ for _ in ()).throw(OioError("the sensor died")))
    with pytest.raises(OioError, match=r"all 2 trials failed\. The first: the sensor died"):
        execute(built("trials=2"), tmp_path / "none", quiet=True)
    assert json.loads((tmp_path / "none" / "status.json").read_text())["state"] == "failed"


@pytest.mark.parametrize(
    "words, says",
    [
        (("trials=0",), "trials is a whole number, 1 or more. Type e.g. trials=100"),
        (("trials=2.5",), "trials is a whole number"),
        (
            ("trials=2", "stage=[warm_up,baseline,calibrate_bouts,map_beliefs,assemble_qr,navigate]"),
            "without the stage 'evaluate' no trial has a result",
        ),
        (("trials=2", "protocol=bench"), "protocol=bench asks a person in every run"),
        (("trials=2", "view=rerun"), "view=rerun shows a single run"),
        (("trials=2", "backend=replay", "backend.log=x.mcap"), "backend=replay is not simulated, and has no other seed"),
    ],
)
def test_what_makes_no_sense_is_refused(words, says):
    with pytest.raises(BadInput, match=says):
        built(*words)


def test_programs_that_have_seeds_of_their_own_refuse_it():
    with pytest.raises(BadInput, match=r"Type e\.g\. seeds=0:5"):
        composed_trial((*SHORT, "trials=5"))
    with pytest.raises(BadInput, match="call again with another seed"):
        simulate("ec", trials=5)


def test_another_seed_reaches_every_stream():
    other = reseeded(built("seeds.truth=9"), 5)
    assert (other.seed, other.backend.seeds.truth, other.backend.seeds.measurement) == (5, 9, 5)


def test_a_stop_keeps_the_trials_that_are_done(tmp_path):
    out = tmp_path / "run"
    line = [sys.executable, "-m", "oio.run", *SHORT, "trials=500", f"hydra.run.dir={out}"]
    run = subprocess.Popen(line, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    until = time.monotonic() + 120
    while time.monotonic() < until and not (out.is_dir() and (out / "trials.csv").exists() and len(rows(out)) >= 2):
        time.sleep(0.05)
    run.send_signal(signal.SIGINT)
    _, errors = run.communicate(timeout=30)
    assert run.returncode == 130 and "of 500 trials have ended, and stand in" in errors and "Traceback" not in errors
    assert json.loads((out / "status.json").read_text())["state"] == "interrupted" and len(rows(out)) >= 2


@pytest.mark.slow
def test_a_sweep_of_such_jobs_has_one_table(tmp_path):
    line = [
        sys.executable,
        "-m",
        "oio.run",
        "-m",
        *SHORT[1:],
        "sensor=ec,ndir",
        "trials=2",
        "cache=off",
        f"hydra.sweep.dir={tmp_path / 's'}",
    ]
    run = subprocess.run(line, cwd=ROOT, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    assert [len(rows(folder)) for folder in sorted((tmp_path / "s").glob("*_3dof*"))] == [2, 2]
    assert run.stdout.count("3 to 4") == 2 and re.search(r"(100|50|0) %", run.stdout)
    table = [sys.executable, "-m", "oio.sweep", "table", str(tmp_path / "s"), "--out", str(tmp_path / "t.csv")]
    assert subprocess.run(table, cwd=ROOT, capture_output=True, check=False).returncode == 0
