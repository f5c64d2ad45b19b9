"""`hydra/launcher=dask`: a scheduler and workers that share no folder with the sweep, one of which is killed."""

import os
import signal
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import pytest

from oio.sweep import dask_cluster
from oio.sweep.dask_cluster import Collected, DaskCluster
from oio.sweep.manifest import Job, Manifest
from oio.sweep.worker import Work

pytestmark = pytest.mark.long

pytest.importorskip("distributed")

ROOT = Path(__file__).resolve().parents[1]
TINY = ("stage=[warm_up,baseline]", "cache=off")  # so that no test is answered by another


def sweep_words(folder, *given):
    return [sys.executable, "-m", "oio.run", "-m", *given, *TINY, f"hydra.sweep.dir={folder}"]


@pytest.fixture
def cluster(tmp_path):
    """Start a scheduler and three workers, each in a working directory of its own; yields the address and the workers."""
    import distributed

    processes, scheduler_file = [], tmp_path / "scheduler.json"

    def start(name, command, *line):
        (tmp_path / name).mkdir()
        words = [sys.executable, "-m", f"distributed.cli.{command}", "--scheduler-file", str(scheduler_file), "--no-dashboard", *line]
        environment = {**os.environ, "PYTHONPATH": str(ROOT), "TMPDIR": str(tmp_path / name)}
        with (tmp_path / name / "log").open("w") as log:
            processes.append(subprocess.Popen(words, cwd=tmp_path / name, stdout=log, stderr=log, env=environment))
        return processes[-1]

    start("scheduler", "dask_scheduler", "--host", "127.0.0.1", "--port", "0")
    until = time.monotonic() + 60
    while not scheduler_file.exists() and time.monotonic() < until:
        time.sleep(0.1)
    workers = [start(f"worker{i}", "dask_worker", "--nthreads", "1", "--no-nanny") for i in range(3)]
    with distributed.Client(scheduler_file=str(scheduler_file)) as client:
        client.wait_for_workers(3, timeout=60)
        address = client.scheduler.address
    yield address, workers
    for process in processes:
        process.kill()
        process.wait()


def sleeping(job, places, version, collect):
    """In place of a job: it takes a while, and sends back as much as a run without its log."""
    time.sleep(2.0)
    return Collected("done", None, {"summary.json": b"x" * 3000, "config.yaml": b"y" * 23_000, "status.json": b'{"state": "done"}'}, None)


@pytest.mark.slow
@pytest.mark.alone
def test_fifty_workers_are_fed(tmp_path, monkeypatch):
    """What the parent does for a job, scheduler included, leaves room for a hundred workers at jobs of a second each.

    Ten workers are the threads of a process: fifty processes would take a minute to begin on two cores.
    """
    import cloudpickle
    import distributed

    monkeypatch.setattr(dask_cluster, "run_elsewhere", sleeping)
    cloudpickle.register_pickle_by_value(sys.modules[__name__])
    works = [Work(Job(i, (f"seed={i}",), str(i)), tmp_path / str(i)) for i in range(500)]
    spent, states = [], Counter()
    with distributed.LocalCluster(n_workers=5, threads_per_worker=10, host="127.0.0.1", dashboard_address="127.0.0.1:0") as cluster:
        for _, state, _ in DaskCluster(cluster.scheduler_address, 0, "auto", 0, "all").run(works):
            states[state] += 1
            spent.append((time.process_time(), time.monotonic()))
    assert states == {"done": 500}
    cpu_s, wall_s = (spent[-1][i] - spent[50][i] for i in (0, 1))
    print(f"{1e3 * cpu_s / 450:.1f} ms a job in the parent; {wall_s:.0f} s, {450 * 2.0 / 50:.0f} s without any")
    assert cpu_s / 450 < 0.010 and wall_s < 1.5 * 450 * 2.0 / 50


def records(folder):
    from oio.sweep.records import records

    return records(Manifest.read(folder).outcomes())


def test_a_cluster_gives_the_results_of_one_process_though_a_worker_is_killed(cluster, tmp_path):
    address, workers = cluster
    given = ("sensor=ndir,pa", "seed=range(0,6)")
    far, near = tmp_path / "far", tmp_path / "near"
    line = sweep_words(far, *given, "hydra/launcher=dask", f"hydra.launcher.address={address}")
    going = subprocess.Popen(line, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    until = time.monotonic() + 120
    while len(list(far.glob("*/summary.json"))) < 2:
        assert time.monotonic() < until and going.poll() is None, going.communicate()
        time.sleep(0.05)
    workers[0].send_signal(signal.SIGKILL)
    said = going.communicate(timeout=200)
    assert going.returncode == 0, said
    assert subprocess.run(sweep_words(near, *given), cwd=ROOT, capture_output=True, timeout=200, check=False).returncode == 0
    assert records(far) == records(near)
    for path in near.glob("*/run.mcap"):
        assert (far / path.parent.name / "run.mcap").stat().st_size > 0
    assert not list(tmp_path.glob("worker1/oio_job_*"))  # collected, so nothing is left behind


@pytest.mark.slow  # a page of the documentation makes one, too
def test_a_cluster_is_made_where_none_is_given_and_logs_may_stay(tmp_path):
    given = ("hydra/launcher=dask", "hydra.launcher.n_jobs=1", "hydra.launcher.collect=summary")
    line, environment = sweep_words(tmp_path / "s", "sensor=ndir", "seed=0,1", *given), {**os.environ, "TMPDIR": str(tmp_path)}
    done = subprocess.run(line, cwd=ROOT, capture_output=True, text=True, timeout=200, check=False, env=environment)
    assert done.returncode == 0, done.stderr
    assert "Dask dashboard: http://127.0.0.1" in done.stderr
    job = tmp_path / "s" / "0_ndir_5dof_seed0"
    assert {path.name for path in job.iterdir()} == {"calibration.yaml", "config.yaml", "log_is_at.txt", "status.json", "summary.json"}
    assert Path((job / "log_is_at.txt").read_text().strip().split(":", 1)[1], "run.mcap").is_file()


@pytest.mark.parametrize(
    ("word", "code", "said"),
    [
        ("hydra.launcher.collect=some", 2, "collect is all or summary"),
        pytest.param("hydra.launcher.address=tcp://127.0.0.1:9", 1, "no scheduler answers", marks=pytest.mark.slow),  # it waits for one
    ],
)
def test_wrong_words_for_a_cluster(tmp_path, word, code, said):
    line = sweep_words(tmp_path / "s", "seed=0,1", "hydra/launcher=dask", word)
    done = subprocess.run(line, cwd=ROOT, capture_output=True, text=True, timeout=200, check=False)
    assert done.returncode == code and said in done.stderr, done.stderr
