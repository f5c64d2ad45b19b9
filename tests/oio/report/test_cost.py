"""What a report costs: less processor time than the run that it tells of, so that it is there within seconds."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
AT_MOST = 1.2  # of a run with report=false; 4.4 s of 5.0 s on a core of a small computer


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="needs a system that keeps a process on one core")
def test_a_report_takes_no_longer_than_its_run(tmp_path):
    """Together on one core, report and run meet the same load of the machine; the first run writes what is reported, and compiles."""
    run = [sys.executable, "-m", "oio.run", "sensor=ec", "dof=5", "seed=100", "report=false"]
    done = subprocess.run([*run, f"hydra.run.dir={tmp_path / 'first'}"], cwd=ROOT, stdout=subprocess.DEVNULL, check=False)
    assert done.returncode in (0, 3)
    report = [sys.executable, "-m", "oio.report", str(tmp_path / "first"), "--out", str(tmp_path / "report.html")]
    cores = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(cores)})
    try:
        started = {
            name: subprocess.Popen(command, cwd=ROOT, stdout=subprocess.DEVNULL)
            for name, command in (("run", [*run, f"hydra.run.dir={tmp_path / 'second'}"]), ("report", report))
        }
    finally:
        os.sched_setaffinity(0, cores)
    took = {name: _spent_s(process) for name, process in started.items()}
    assert took["report"] / took["run"] < AT_MOST, took
    assert (tmp_path / "report.html").stat().st_size < 3_000_000


def _spent_s(process):
    """Processor time of a process that has ended well [s]."""
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    assert process.returncode in (0, 3)
    return usage.ru_utime + usage.ru_stime
