"""Calibrations of simulated runs: one specimen measured twice agrees, in another turbulence, too; another specimen differs."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from oio.compare.__main__ import main
from oio.compare.comparison import compare
from oio.results.calibration_entries import read_calibration

pytestmark = pytest.mark.long

ROOT = Path(__file__).resolve().parents[1]
SHORT = (
    "sensor=ec", "dof=3", "stage=[warm_up,baseline,calibrate_bouts,map_beliefs,assemble_qr]", "stage.calibrate_bouts.moves_per_rung=2",
    "stage.map_beliefs.repeats=2", "stage.map_beliefs.budget_s=0",
)  # fmt: skip
SEEDS = {"monday": (0, 0), "tuesday": (0, 1), "friday": (1, 1)}  # of turbulence and of noise; the truth is that of seed 0


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Folders of calibrations by day, and of another specimen."""
    folder = tmp_path_factory.mktemp("runs")
    words = {day: (f"seeds.disturbance={air}", f"seeds.measurement={noise}") for day, (air, noise) in SEEDS.items()}
    for name, seeds in {**words, "other": ("seeds.truth=5",)}.items():
        line = [sys.executable, "-m", "oio.run", *SHORT, "report=false", *seeds, f"hydra.run.dir={folder / name}"]
        subprocess.run(line, cwd=ROOT, env=os.environ, capture_output=True, check=True, timeout=300)
    return folder


@pytest.mark.parametrize("day", ["tuesday", "friday"])
def test_a_specimen_agrees_with_itself(runs, day, capsys):
    assert main([str(runs / "monday"), str(runs / day)]) == 0
    assert "agree within their uncertainty (sensor and arm)." in capsys.readouterr().out


def test_another_specimen_differs(runs, capsys):
    assert main([str(runs / "monday"), str(runs / "other" / "calibration.yaml")]) == 3
    assert "differ: sensor.element_" in capsys.readouterr().out


def test_a_week_agrees(runs):
    week = compare([read_calibration(runs / day) for day in SEEDS], ("sensor", "arm"))
    assert week.agree and week.dof > 20


def test_folder_file_and_log_are_one_calibration(runs):
    folder, file, log = (read_calibration(runs / "monday" / name) for name in ("", "calibration.yaml", "run.mcap"))
    assert folder.quantities == file.quantities == log.quantities
    assert folder.facts == file.facts == log.facts and folder.facts["sensor"] == "ec"
