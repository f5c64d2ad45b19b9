"""Ctrl-C while a command is still importing, and while it works."""

import subprocess
import sys
from pathlib import Path

import pytest

from oio.cli.command_table import COMMANDS

pytestmark = pytest.mark.long

ROOT = Path(__file__).resolve().parents[3]
MODULES = [*(module for module, _ in COMMANDS.values()), "oio.gym.train"]

IMPATIENT = """
import os, runpy, signal, sys
class Finder:
    def find_spec(self, name, path=None, target=None):
        if signal.getsignal(signal.{signal}) not in (signal.SIG_DFL, signal.default_int_handler):
            os.kill(os.getpid(), signal.{signal})
sys.meta_path.insert(0, Finder())
sys.argv[1:] = ["--help"]
runpy.run_module({command!r}, run_name="__main__")
"""

AT_WORK = """
import os, runpy, signal, sys, time
import {module} as module
def work(*_, **__):
    os.kill(os.getpid(), signal.{signal})
    time.sleep(20.0)
module.{function} = work
sys.argv[1:] = {arguments!r}
runpy.run_module({command!r}, run_name="__main__")
"""


@pytest.mark.parametrize("signal", ["SIGINT", "SIGTERM"])
@pytest.mark.parametrize("command", MODULES)
def test_a_stop_before_a_command_has_begun_ends_it_with_one_line(command, signal):
    """At the first import after the handlers are there; a command that installs none prints its help, and fails here."""
    assert _ended(IMPATIENT.format(command=command, signal=signal)) == (130, "", "oio: stopped.\n")


@pytest.mark.parametrize("signal", ["SIGINT", "SIGTERM"])
@pytest.mark.parametrize(
    ("command", "module", "function", "arguments"),
    [
        ("oio.report", "oio.report.write", "run_report", ["."]),
        ("oio.identify", "oio.identify.logged", "read_logged_run", ["."]),
        ("oio.compare", "oio.results.calibration_entries", "read_calibration", ["a", "b"]),
        ("oio.figures", "oio.figures.picture", "draw", ["."]),
        ("oio.view", "oio.log", "read_entries", ["."]),
        ("oio.inspect", "oio.inspect.survey", "survey", ["README.md"]),
        ("oio.recover", "oio.log", "salvage", ["a"]),
        ("oio.reproduce", "oio.reproduce.original", "original", ["."]),
        ("oio.sweep", "oio.sweep.commands", "status", ["status", "."]),
    ],
)
def test_the_first_stop_ends_a_command_that_works(command, module, function, arguments, signal):
    code = AT_WORK.format(command=command, module=module, function=function, arguments=arguments, signal=signal)
    assert _ended(code) == (130, "", "oio: stopped.\n")


def _ended(code: str) -> tuple[int, str, str]:
    run = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False, timeout=60)
    return run.returncode, run.stdout, run.stderr
