"""Launchers and sweepers of others: Optuna proposes, submitit runs; each is told what it needs, and says what is missing."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).resolve().parents[1]
TINY = ("stage=[warm_up,baseline]", "cache=off")


def sweep(folder, *given):
    line = [sys.executable, "-m", "oio.run", "-m", *given, *TINY, f"hydra.sweep.dir={folder}"]
    return subprocess.run(line, cwd=ROOT, capture_output=True, text=True, timeout=300, check=False)


def optuna(folder, trials, objective="dof"):
    words = ("hydra/sweeper=optuna", f"hydra.sweeper.n_trials={trials}", "hydra.sweeper.n_jobs=1", "hydra.sweeper.sampler.seed=1")
    aim = (f"hydra.launcher.objective={objective}", "hydra.launcher.objective_seeds=[3,4]")
    return sweep(folder, "sensor=ndir", "stage.warm_up.max_s=interval(50,60)", *words, *aim)


@pytest.mark.slow  # a page of the documentation runs it, too
def test_optuna_is_told_the_median_over_seeds_and_goes_on_where_it_was(tmp_path):
    pytest.importorskip("optuna")
    folder = tmp_path / "tuned"
    assert optuna(folder, 2).returncode == 0
    jobs = json.loads((folder / "sweep.json").read_text())["jobs"]
    assert [[word for word in job["overrides"] if word.startswith("seed=")] for job in jobs] == [["seed=3"], ["seed=4"]] * 2
    told = yaml.safe_load((folder / "optimization_results.yaml").read_text())
    assert told["best_value"] == 5.0 and 50.0 <= told["best_params"]["stage.warm_up.max_s"] <= 60.0
    more = optuna(folder, 3)
    assert more.returncode == 0 and more.stderr.count("2 are done already and are not run again") == 2


def test_an_objective_that_is_no_number_is_refused(tmp_path):
    pytest.importorskip("optuna")
    done = optuna(tmp_path / "tuned", 1, "calibrated.source_error_m")
    assert done.returncode != 0 and "is no number of summary.json" in done.stderr


@pytest.mark.slow
def test_submitit_runs_jobs_on_this_machine_and_never_into_a_used_folder(tmp_path):
    pytest.importorskip("submitit")
    words = ("sensor=ndir", "seed=0,1", "hydra/launcher=submitit_local")
    first = sweep(tmp_path / "s", *words)
    assert first.returncode == 0, first.stderr
    assert first.stdout.count("done") == 2
    again = sweep(tmp_path / "s", *words)
    assert again.returncode != 0 and "already holds a run" in again.stderr


@pytest.mark.parametrize(("word", "extra"), [("hydra/sweeper=optuna", "optuna"), ("hydra/launcher=submitit_slurm", "slurm")])
def test_a_missing_extra_is_named(word, extra):
    from oio.cli.hydra_errors import _no_such_choice

    group, _, name = word.partition("=")
    assert _no_such_choice(group, name, ROOT / "conf") == f"{word} needs a package that is not installed. Type: pip install 'oio[{extra}]'"
