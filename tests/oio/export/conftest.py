"""A short simulated run, and logs written by hand."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from oio.export.run_record import RunRecord, read_run_record
from oio.log import RunLog

ROOT = Path(__file__).resolve().parents[3]
SHORT = (
    "sensor=ec", "dof=3", "stage=[warm_up,baseline,calibrate_bouts,map_beliefs,assemble_qr,navigate]",
    "stage.calibrate_bouts.moves_per_rung=2", "stage.map_beliefs.repeats=2", "stage.map_beliefs.budget_s=0", "stage.navigate.max_moves=12",
)  # fmt: skip


@pytest.fixture(scope="session")
def folder(tmp_path_factory) -> Path:
    """The folder of a simulated run."""
    out = tmp_path_factory.mktemp("run") / "first"
    line = [sys.executable, "-m", "oio.run", *SHORT, "report=false", f"hydra.run.dir={out}"]
    subprocess.run(line, cwd=ROOT, env=os.environ, capture_output=True, check=True, timeout=300)
    return out


@pytest.fixture(scope="session")
def record(folder) -> RunRecord:
    """What the log of that run holds."""
    return read_run_record(folder / "run.mcap")


@pytest.fixture
def logged(tmp_path):
    """logged(*samples, metadata) is a log of one joint without a model of the arm; `odometry` are (t_ns, nose, covariance)."""

    def write(*samples, odometry=(), attachments=None, **metadata) -> Path:
        path = tmp_path / "by_hand.mcap"
        with RunLog.create(path, sensor="ec", joints=("pan",), metadata=metadata, attachments=attachments or {}) as log:
            for sample in samples:
                log.write(sample)
            for row in odometry:
                log.odometry(*row)
        return path

    return write
