"""One small run, and one small sweep, for all tests of reports."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
TINY = ("sensor=mox_mics", "dof=3", "seed=4", "stage.navigate.max_moves=10", "stage.calibrate_bouts.moves_per_rung=2")


def run(*words):
    line = [sys.executable, "-m", "oio.run", *words]
    return subprocess.run(line, cwd=ROOT, capture_output=True, text=True, timeout=300, check=False)


@pytest.fixture(scope="session")
def command():
    """command("dof=3") runs `python -m oio.run dof=3`."""
    return run


@pytest.fixture(scope="session")
def made(tmp_path_factory):
    """The folder of a run that wrote its report, and what its command said."""
    folder = tmp_path_factory.mktemp("report") / "run"
    return folder, run(*TINY, f"hydra.run.dir={folder}")


@pytest.fixture(scope="session")
def swept(tmp_path_factory):
    """The folder of a sweep of two runs."""
    folder = tmp_path_factory.mktemp("report") / "sweep"
    done = run("-m", *TINY[1:], "sensor=mox_mics,ndir", "logging=summary", "cache=off", f"hydra.sweep.dir={folder}")
    assert done.returncode == 0, done.stderr
    return folder
