"""Ctrl-C while a command is still importing."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]

IMPATIENT = """
import os, runpy, signal, sys
class Finder:
    def find_spec(self, name, path=None, target=None):
        if name == {late!r}:
            os.kill(os.getpid(), signal.{signal})
sys.meta_path.insert(0, Finder())
runpy.run_module({command!r}, run_name="__main__")
"""


@pytest.mark.parametrize("signal", ["SIGINT", "SIGTERM"])
@pytest.mark.parametrize(
    ("command", "late"),
    [
        ("oio.run", "hydra"),
        ("oio.bench", "joblib"),
        ("hardware.emulate", "mujoco"),
        ("hardware.ports", "serial"),
        ("hardware.home", "hydra"),
    ],
)
def test_a_stop_before_a_command_has_begun_ends_it_with_one_line(command, late, signal):
    code = IMPATIENT.format(command=command, late=late, signal=signal)
    run = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False, timeout=60)
    assert (run.returncode, run.stdout, run.stderr) == (130, "", "oio: stopped.\n")
