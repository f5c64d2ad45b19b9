"""A sweep that is stopped, killed or begun again: what is done is kept and not run again, and nothing old is shown as new."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from oio.cli.run_folder import RunFolder, state_of, write_status
from oio.sweep.manifest import Manifest

pytestmark = pytest.mark.long

ROOT = Path(__file__).resolve().parents[1]
TINY = ("stage=[warm_up,baseline]", "cache=off")  # so that no test is answered by another
DASK = ("hydra/launcher=dask", "hydra.launcher.n_jobs=2")
JOBLIB = ("hydra/launcher=joblib", "hydra.launcher.n_jobs=2")


def words(folder, *given):
    return [sys.executable, "-m", "oio.run", "-m", *given, *TINY, f"hydra.sweep.dir={folder}"]


def sweep(folder, *given):
    return subprocess.run(words(folder, *given), cwd=ROOT, capture_output=True, text=True, timeout=300, check=False)


def tool(*given):
    line = [sys.executable, "-m", "oio.sweep", *map(str, given)]
    return subprocess.run(line, cwd=ROOT, capture_output=True, text=True, timeout=300, check=False)


def stamps(folder):
    """When each job's result was written."""
    return {path.parent.name: path.stat().st_mtime_ns for path in folder.glob("*/summary.json")}


def begun(folder, least=1):
    """Wait until so many jobs have begun."""
    until = time.monotonic() + 120
    while len(list(folder.glob("*/run.mcap.part"))) < least:
        assert time.monotonic() < until, "no job began"
        time.sleep(0.02)


def ended(folder):
    """Wait until a job has come back: those of a cluster run elsewhere."""
    until = time.monotonic() + 120
    while not list(folder.glob("*/summary.json")):
        assert time.monotonic() < until, "no job ended"
        time.sleep(0.02)


# ---- a used folder


@pytest.fixture(scope="module")
def used(tmp_path_factory):
    folder = tmp_path_factory.mktemp("used") / "sweep"
    done = sweep(folder, "sensor=ndir", "seed=0,1")
    assert done.returncode == 0, done.stderr
    return folder


def test_another_sweep_into_the_folder_is_not_answered_with_the_old_results(used):
    before = stamps(used)
    done = sweep(used, "sensor=ndir", "seed=0,1", "air=draft")
    assert done.returncode == 0 and "still" not in done.stdout, done.stdout
    assert done.stdout.count("draft") == 2 and "2 jobs," in done.stdout
    assert {name: stamps(used)[name] for name in before} == before


def test_the_same_sweep_runs_nothing_and_says_so(used):
    before = stamps(used)
    done = sweep(used, "seed=0,1", "sensor=ndir")  # in another order, too
    assert done.returncode == 0 and "2 are done already and are not run again" in done.stderr
    assert stamps(used) == before


def test_more_seeds_extend_it(used):
    before = stamps(used)
    done = sweep(used, "sensor=ndir", "seed=0,1,2")
    assert "2 are done already and are not run again, 1 are new" in done.stderr
    assert {name: stamps(used)[name] for name in before} == before and len(stamps(used)) == len(before) + 1


def test_results_of_another_version_are_not_mixed_in(used):
    path = used / "sweep.json"
    kept = path.read_text(encoding="utf-8")
    path.write_text(kept.replace(Manifest.read(used).version, "0123456789abcdef"), encoding="utf-8")
    try:
        done = sweep(used, "sensor=ndir", "seed=0,1")
        assert done.returncode == 2 and "another version" in done.stderr and "--any-version" in done.stderr
        assert tool("resume", used).returncode == 2
        assert tool("resume", used, "--any-version").returncode == 0
    finally:
        path.write_text(kept, encoding="utf-8")


def test_a_folder_of_runs_that_are_no_sweep_is_refused(tmp_path):
    (tmp_path / "0_ec_5dof_seed0").mkdir()
    write_status(tmp_path / "0_ec_5dof_seed0", "done")
    done = sweep(tmp_path, "sensor=ndir", "seed=0,1")
    assert done.returncode == 2 and "of no sweep known here" in done.stderr


def test_two_jobs_never_share_a_folder(tmp_path):
    done = sweep(tmp_path / "s", "sensor=ndir", "seed=0,1", "hydra.sweep.subdir=x")
    assert done.returncode == 2 and "a folder of its own" in done.stderr


# ---- stopped and killed


def to_the_group(going):
    """Ctrl-C in a terminal reaches the workers as well."""
    os.killpg(going.pid, signal.SIGINT)


STOPS = {"SIGINT": lambda going: going.send_signal(signal.SIGINT), "SIGTERM": lambda going: going.send_signal(signal.SIGTERM)}


@pytest.mark.parametrize(
    "stop", [to_the_group, *(pytest.param(stop, marks=pytest.mark.slow) for stop in STOPS.values())], ids=["Ctrl-C", *STOPS]
)
@pytest.mark.parametrize("launcher", [JOBLIB, pytest.param(DASK, marks=pytest.mark.slow)], ids=["joblib", "dask"])
def test_a_stop_ends_the_sweep_within_seconds_and_says_how_to_go_on(tmp_path, launcher, stop):
    if launcher is DASK:
        pytest.importorskip("distributed")
    folder = tmp_path / "sweep"
    line = words(folder, *launcher, "sensor=ndir", "seed=range(0,40)")
    going = subprocess.Popen(line, cwd=ROOT, stderr=subprocess.PIPE, text=True, start_new_session=True)
    begun(folder) if launcher is JOBLIB else ended(folder)
    asked = time.monotonic()
    stop(going)
    said = going.communicate(timeout=60)[1]
    assert going.returncode == 130 and time.monotonic() - asked < 5.0
    assert f"Go on with: python -m oio.sweep resume {folder}" in said
    assert "Traceback" not in said
    states = [outcome.state for outcome in Manifest.read(folder).outcomes()]
    assert "missing" in states and set(states) <= {"done", "interrupted", "missing"}


def test_the_one_by_one_sweep_stops_as_well(tmp_path):
    folder = tmp_path / "sweep"
    going = subprocess.Popen(words(folder, "sensor=ndir", "seed=range(0,40)"), cwd=ROOT, stderr=subprocess.PIPE, text=True)
    begun(folder)
    going.send_signal(signal.SIGINT)
    said = going.communicate(timeout=60)[1]
    assert going.returncode == 130 and "resume" in said and "Traceback" not in said


def test_a_killed_sweep_is_resumed_to_the_table_of_an_undisturbed_one(tmp_path):
    calm, stormy = tmp_path / "calm", tmp_path / "stormy"
    given = ("sensor=ndir,pa", "seed=range(0,4)")
    assert sweep(calm, *JOBLIB, *given).returncode == 0
    going = subprocess.Popen(words(stormy, *JOBLIB, *given), cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    begun(stormy)
    going.kill()
    going.wait()
    assert "not running" in tool("status", stormy).stdout
    resumed = tool("resume", stormy)
    assert resumed.returncode == 0, resumed.stderr
    assert table(stormy) == table(calm)


@pytest.mark.slow
def test_a_killed_worker_costs_its_job_a_retry(tmp_path):
    calm, stormy = tmp_path / "calm", tmp_path / "stormy"
    given = ("sensor=ndir", "seed=range(0,6)")
    assert sweep(calm, *JOBLIB, *given).returncode == 0
    going = subprocess.Popen(words(stormy, *JOBLIB, *given), cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    begun(stormy)
    for worker in workers_of(going.pid)[:1]:
        os.kill(worker, signal.SIGKILL)
    said = going.communicate(timeout=120)
    assert going.returncode == 0, said
    assert table(stormy) == table(calm)


@pytest.mark.slow
def test_twenty_kills_change_nothing_in_the_table(tmp_path):
    """SIGKILL of a worker or of the parent at a random moment, twenty times; then the sweep is resumed to its end."""
    rng = np.random.default_rng(20)
    calm, stormy = tmp_path / "calm", tmp_path / "stormy"
    given = ("sensor=ndir,pa,ec,mox_mq,mox_mics", "seed=range(0,20)")
    assert sweep(calm, *JOBLIB, *given).returncode == 0
    line, met = words(stormy, *JOBLIB, *given), 0
    for kill in range(20):
        going = subprocess.Popen(line, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        if kill % 5:  # else it is killed while it starts
            works(going)
            time.sleep(float(rng.uniform(0.0, 1.5)))
        for worker in workers_of(going.pid)[: kill % 3]:
            os.kill(worker, signal.SIGKILL)
        time.sleep(float(rng.uniform(0.0, 1.5)))
        going.kill()
        going.wait()
        line = [sys.executable, "-m", "oio.sweep", "resume", str(stormy)] if (stormy / "sweep.json").exists() else line
        met += any(outcome.state != "done" for outcome in Manifest.read(stormy).outcomes()) if (stormy / "sweep.json").exists() else 1
    assert tool("resume", stormy).returncode == 0
    assert table(stormy) == table(calm)
    assert met >= 10, "the sweep was done before it was killed often enough"


@pytest.mark.slow
def test_a_full_disk_costs_the_jobs_that_it_met_and_no_others(tmp_path):
    calm, small = tmp_path / "calm", tmp_path / "small"
    small.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=40M", "tmpfs", str(small)], capture_output=True, check=False).returncode != 0:
        pytest.skip("no small disk can be mounted here")
    try:
        given = ("sensor=ndir", "seed=range(0,10)")
        assert sweep(calm, *given).returncode == 0
        going = subprocess.Popen(words(small / "s", *given), cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        while len(list((small / "s").glob("*/summary.json"))) < 3:
            time.sleep(0.05)
        subprocess.run(["dd", "if=/dev/zero", f"of={small / 'fill'}", "bs=64k"], capture_output=True, check=False)  # until it is full
        said = going.communicate(timeout=200)
        assert going.returncode == 1, said
        (small / "fill").unlink()
        resumed = tool("resume", small / "s")
        assert resumed.returncode == 0 and "3 are done already" in resumed.stderr, resumed.stderr
        assert records(small / "s") == records(calm)
    finally:
        subprocess.run(["umount", str(small)], check=False)


def records(folder):
    from oio.sweep.records import records

    return records(Manifest.read(folder).outcomes())


def works(going):
    """Wait until a sweep has workers, or is done: how long it takes to start is the machine's."""
    until = time.monotonic() + 120
    while going.poll() is None and not workers_of(going.pid):
        assert time.monotonic() < until, "no worker began"
        time.sleep(0.02)


def workers_of(parent):
    """Process numbers of the loky workers of a process."""
    found = []
    for path in Path("/proc").glob("[0-9]*"):
        try:
            stat, command = (path / "stat").read_text(), (path / "cmdline").read_bytes()
        except OSError:
            continue
        if stat.rsplit(")", 1)[1].split()[1] == str(parent) and b"popen_loky" in command:
            found.append(int(path.name))
    return found


def table(folder):
    """The table of all jobs as bytes."""
    out = folder.parent / f"{folder.name}.csv"
    assert tool("table", folder, "--by", "job", "--out", out).returncode == 0
    return out.read_bytes()


def test_without_a_log_the_numbers_are_the_same(used):
    folder = used.parent / "summary_only"
    assert sweep(folder, "sensor=ndir", "seed=0,1", "logging=summary").returncode == 0
    assert {path.name for path in (folder / "0_ndir_5dof_seed0").iterdir()} == {
        "calibration.yaml",
        "config.yaml",
        "status.json",
        "summary.json",
    }
    assert [{**row, "logging": "full"} for row in records(used)[:2]] == [{**row, "logging": "full"} for row in records(folder)]
    assert sweep(folder, "sensor=ndir", "seed=0", "logging=some").returncode == 2


def test_jobs_that_failed_run_again_when_the_reason_is_gone(used, tmp_path):
    folder = tmp_path / "sweep"
    assert sweep(folder, "sensor=ndir", "seed=0,1").returncode == 0
    write_status(folder / "1_ndir_5dof_seed1", "failed", "the disk was full")
    before = stamps(folder)
    said = tool("status", folder).stdout
    assert "1 done, 1 failed" in said and "the disk was full" in said
    resumed = tool("resume", folder)
    assert resumed.returncode == 0 and "1 failed and run again" in resumed.stderr
    assert stamps(folder)["0_ndir_5dof_seed0"] == before["0_ndir_5dof_seed0"]
    assert (folder / "1_ndir_5dof_seed1.attempt1").is_dir()  # nothing is lost


def test_a_run_whose_process_is_gone_is_known_from_one_that_goes_on(tmp_path):
    with RunFolder(tmp_path / "run"):
        assert state_of(tmp_path / "run") == ("running", None)
    write_status(tmp_path / "run", "running")
    assert state_of(tmp_path / "run") == ("killed", None)
    (tmp_path / "run" / "status.json").write_text("{", encoding="utf-8")
    assert state_of(tmp_path / "run")[0] == "killed"


def test_two_sweeps_in_one_folder_at_a_time_are_refused(tmp_path):
    folder = tmp_path / "sweep"
    going = subprocess.Popen(words(folder, "sensor=ndir", "seed=range(0,40)"), cwd=ROOT, stderr=subprocess.DEVNULL)
    try:
        begun(folder)
        assert "running" in tool("status", folder).stdout
        second = tool("resume", folder)
        assert second.returncode == 2 and "a sweep is running" in second.stderr
    finally:
        going.terminate()
        going.wait()


@pytest.mark.slow
def test_sweeps_of_the_same_second_share_no_folder(tmp_path):
    line = [sys.executable, "-m", "oio.run", "-m", "sensor=ndir", "seed=0", *TINY]
    going = [subprocess.Popen(line, cwd=tmp_path, stdout=subprocess.DEVNULL, env={**os.environ, "PYTHONPATH": str(ROOT)}) for _ in range(4)]
    assert [each.wait(timeout=300) for each in going] == [0] * 4
    assert len(list(tmp_path.glob("outputs/*/*_sweep/sweep.json"))) == 4


# ---- launchers


@pytest.mark.parametrize("backend", ["dask", "threading"])
def test_a_backend_that_is_not_there_is_refused_and_not_replaced(tmp_path, backend):
    done = sweep(tmp_path / "s", *JOBLIB, f"hydra.launcher.backend={backend}", "seed=0,1")
    assert done.returncode == 2 and f"hydra.launcher.backend={backend} was given" in done.stderr
    assert not (tmp_path / "s").exists()


@pytest.mark.parametrize(
    ("word", "said"),
    [
        ("hydra/launcher=x", "hydra/launcher can be joblib, basic, dask"),
        ("hydra.launcher.n_jobs=0", "1 or more"),
        ("hydra.launcher.retries=-1", "0 or more"),
        ("stage.warm_up.max_s=interval(50,60)", "hydra/sweeper=optuna"),
    ],
)
def test_wrong_words_for_a_launcher(tmp_path, word, said):
    done = sweep(tmp_path / "s", "hydra/launcher=joblib", word, "seed=0,1")
    assert done.returncode == 2 and said in done.stderr and done.stderr.count("\n") == 1
    assert not (tmp_path / "s").exists()


def test_a_sweep_with_choices_of_ones_own_is_resumed_from_anywhere(tmp_path):
    """Folders given relative to the working directory, by both ways to give them."""
    for folder, name in (("one", "quick"), ("two", "slow")):
        (tmp_path / folder / "profile").mkdir(parents=True)
        text = (ROOT / "conf" / "profile" / "paper.yaml").read_text(encoding="utf-8")
        (tmp_path / folder / "profile" / f"{name}.yaml").write_text(text, encoding="utf-8")
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    own = ("--config-dir", "one", "hydra.searchpath=[file://two]", "profile=quick,slow")
    line = words("swept", *own, "sensor=ndir", "seed=0")
    done = subprocess.run(line, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    folder = tmp_path / "swept"
    write_status(folder / next(iter(stamps(folder))), "failed", "the disk was full")
    refused = tool("resume", folder)
    needed = f"--config-dir {tmp_path / 'one'} --config-dir {tmp_path / 'two'}"
    assert refused.returncode == 2 and needed in refused.stderr
    assert tool("resume", folder, *needed.split()).returncode == 0


def test_a_scheduler_elsewhere_is_named_again(used):
    """What a scheduler answers is unpickled: a file that came from elsewhere must not choose it."""
    path = used / "sweep.json"
    kept = path.read_text(encoding="utf-8")
    about = {"name": "dask", "workers": 1, "memory_limit": "auto", "retries": 2, "collect": "all", "address": "tcp://10.0.0.5:8786"}
    path.write_text(json.dumps({**json.loads(kept), "launcher": about}), encoding="utf-8")
    try:
        refused = tool("resume", used)
        assert refused.returncode == 2 and "--address tcp://10.0.0.5:8786, or --jobs 2" in refused.stderr
        assert tool("resume", used, "--jobs", "1").returncode == 0
    finally:
        path.write_text(kept, encoding="utf-8")


def test_the_manifest_is_data(tmp_path):
    """An override in sweep.json that would name a class to build is refused."""
    folder = tmp_path / "sweep"
    assert sweep(folder, "sensor=ndir", "seed=0,1").returncode == 0
    told = json.loads((folder / "sweep.json").read_text(encoding="utf-8"))
    told["jobs"][0]["overrides"].append("+sensor._target_=os.system")
    (folder / "sweep.json").write_text(json.dumps(told), encoding="utf-8")
    done = tool("resume", folder)
    assert done.returncode == 2 and "_target_" in done.stderr
    told["jobs"][0]["overrides"].pop()
    del told["places"]
    (folder / "sweep.json").write_text(json.dumps(told), encoding="utf-8")
    assert tool("resume", folder).returncode == 2
    told["places"] = []
    told["jobs"][0]["folder"] = "../elsewhere"
    (folder / "sweep.json").write_text(json.dumps(told), encoding="utf-8")
    assert tool("resume", folder).returncode == 2
