"""Engines: what a lost worker costs, and settings that come from a file."""

import pytest

from oio.cli.run_folder import write_status
from oio.core.errors import BadInput
from oio.sweep.engine import InThisProcess, WorkerProcesses
from oio.sweep.launch import engine_of
from oio.sweep.manifest import Job
from oio.sweep.worker import Work


def test_a_job_that_ended_before_its_worker_was_lost_is_not_run_again(tmp_path, monkeypatch):
    works = [Work(Job(number, (), str(number)), tmp_path / str(number)) for number in range(4)]
    states = {0: "done", 1: "failed", 2: "running"}  # of 2 the process is gone; 3 had not begun
    for number, state in states.items():
        works[number].out.mkdir()
        write_status(works[number].out, state, "a reason" if state == "failed" else None)
    asked = []

    def until_one_dies(self, handed, lost):
        asked.append(list(handed))
        if len(asked) == 1:
            lost.extend(handed)
            return
        for work in handed:
            yield work, "done", None

    monkeypatch.setattr(WorkerProcesses, "_until_one_dies", until_one_dies)
    ended = [(work.job.number, state, error) for work, state, error in WorkerProcesses(2).run(works)]
    assert ended == [(0, "done", None), (1, "failed", "a reason"), (2, "done", None), (3, "done", None)]
    assert asked[1] == works[2:]


def test_a_job_that_kills_its_workers_is_given_up(tmp_path, monkeypatch):
    work = Work(Job(0, (), "0"), tmp_path / "0")

    def dies(self, handed, lost):
        work.out.mkdir(exist_ok=True)
        write_status(work.out, "running")
        lost.extend(handed)
        return iter(())

    monkeypatch.setattr(WorkerProcesses, "_until_one_dies", dies)
    ((_, state, error),) = WorkerProcesses(2, retries=1).run([work])
    assert state == "killed" and "died 2 times" in error


def test_settings_of_the_file_make_the_engine():
    assert engine_of({"name": "basic"}) == InThisProcess()
    assert engine_of({"name": "joblib", "processes": 3}) == WorkerProcesses(3)


@pytest.mark.parametrize(
    "launcher",
    [{}, {"name": "slurm"}, {"name": "joblib"}, {"name": "joblib", "processes": "two"}, {"name": "basic", "processes": 2}, {"name": []}],
)
def test_settings_that_make_no_engine_are_refused(launcher):
    with pytest.raises(BadInput, match=r"--jobs 2"):
        engine_of(launcher)
