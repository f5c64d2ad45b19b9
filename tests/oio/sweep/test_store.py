"""The store of results: read back bit-equal, and never when anything that a run depends on has changed."""

import errno
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from omegaconf import OmegaConf

from oio.cli.input_files import input_files
from oio.sweep import fingerprint
from oio.sweep import store as store_module
from oio.sweep.fingerprint import folders_of, version_of_everything
from oio.sweep.manifest import Job
from oio.sweep.store import Store

pytestmark = pytest.mark.long

ROOT = Path(__file__).resolve().parents[3]
FILES = {
    "run.mcap": os.urandom(200_000),
    "status.json": b'{"state": "done"}',
    "summary.json": b'{"backend": "mujoco"}',
    "config.yaml": b"a: 1",
}
JOB = Job(0, ("sensor=ec", "seed=1"), "0_ec")


def run_in(folder, **changed):
    folder.mkdir(parents=True)
    for name, data in {**FILES, **changed}.items():
        (folder / name).write_bytes(data)
    return folder


def test_a_run_is_read_back_bit_equal_and_lies_on_the_disk_once(tmp_path):
    store = Store(tmp_path / "store", "v")
    made = run_in(tmp_path / "made")
    store.keep(JOB, made)
    again = Job(7, ("seed=1", "sensor=ec"), "7_ec")  # number, folder and the order of overrides do not matter
    assert store.restore(again, tmp_path / "out")
    assert {path.name: path.read_bytes() for path in (tmp_path / "out").iterdir()} == FILES
    assert (tmp_path / "out" / "run.mcap").stat().st_ino == (made / "run.mcap").stat().st_ino


@pytest.mark.parametrize("other", [Store(Path("store"), "w"), Store(Path("store"), "v", ("file:///conf",))])
def test_another_version_or_place_is_another_run(tmp_path, other):
    Store(tmp_path / "store", "v").keep(JOB, run_in(tmp_path / "made"))
    assert not Store(tmp_path / "store", other.version, other.places).restore(JOB, tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("words", [("sensor=ec", "seed=2"), ("sensor=ec", "seed=1", "dof=3"), ("sensor=ec",)])
def test_other_overrides_are_another_run(tmp_path, words):
    store = Store(tmp_path / "store", "v")
    store.keep(JOB, run_in(tmp_path / "made"))
    assert not store.restore(Job(0, words, "0"), tmp_path / "out")


def test_another_folder_of_recordings_is_another_run(tmp_path, monkeypatch):
    store = Store(tmp_path / "store", "v")
    store.keep(JOB, run_in(tmp_path / "made"))
    monkeypatch.setenv("OIO_DATA", str(tmp_path))
    assert not store.restore(JOB, tmp_path / "out")


def test_a_byte_of_a_recording_makes_it_another_run(tmp_path):
    recording = tmp_path / "recording.csv"
    recording.write_bytes(b"1,2,3")
    inputs = input_files(OmegaConf.create({"backend": {"file": str(recording)}}))
    assert set(inputs) == {str(recording)}
    store = Store(tmp_path / "store", "v")
    store.keep(JOB, run_in(tmp_path / "made", **{"inputs.json": json.dumps(inputs).encode()}))
    assert store.restore(JOB, tmp_path / "out")
    recording.write_bytes(b"1,2,4")
    assert not store.restore(JOB, tmp_path / "out2")


def test_a_plain_word_is_a_file_where_a_key_names_files(tmp_path, monkeypatch):
    """air.path=wind, the folder beside: a sweep would take old results for new ones when its files change."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "wind").mkdir()
    (tmp_path / "wind" / "wind_0.csv").write_text("1")
    cfg = OmegaConf.create({"air": {"path": "wind", "name": "wind"}})
    first = input_files(cfg)
    assert [Path(name).name for name in first] == ["wind_0.csv"]
    (tmp_path / "wind" / "wind_0.csv").write_text("22")
    assert input_files(cfg) != first
    assert input_files(OmegaConf.create({"air": {"name": "wind"}})) == {}


@pytest.mark.parametrize("recording", ["airscout32", "co2_scd30x4", "orebro3dsen"])
def test_every_recording_is_among_the_files_that_a_run_reads(composed, recording):
    data = Path(os.environ.get("OIO_DATA", "data"))
    if not (data / recording).is_dir():
        pytest.skip("the recordings are not here")
    read = input_files(composed("backend=recording", f"recording={recording}"))
    assert read and all(Path(name).is_relative_to(data) for name in read)


def test_a_run_in_simulation_reads_no_files(composed):
    assert input_files(composed()) == {}


def test_an_entry_that_was_damaged_does_not_count(tmp_path):
    store = Store(tmp_path / "store", "v")
    store.keep(JOB, run_in(tmp_path / "made"))
    summary = next((tmp_path / "store").glob("*/summary.json"))
    summary.write_bytes(b"{}")
    assert not store.restore(JOB, tmp_path / "out")


@pytest.mark.parametrize("summary", [b'{"backend": "serial"}', b"{"])
def test_hardware_and_what_is_not_whole_is_not_kept(tmp_path, summary):
    store = Store(tmp_path / "store", "v")
    store.keep(JOB, run_in(tmp_path / "made", **{"summary.json": summary}))
    assert not (tmp_path / "store").exists()


def test_a_store_that_cannot_be_written_costs_nothing_but_the_entry(tmp_path):
    (tmp_path / "store").write_text("a file")
    store = Store(tmp_path / "store", "v")
    store.keep(JOB, run_in(tmp_path / "made"))
    assert (tmp_path / "store").read_text() == "a file" and not store.restore(JOB, tmp_path / "out")
    assert {path.name: path.read_bytes() for path in (tmp_path / "made").iterdir()} == FILES


def test_an_entry_that_no_longer_counts_is_replaced(tmp_path):
    store = Store(tmp_path / "store", "v")
    store.keep(JOB, run_in(tmp_path / "made"))
    next((tmp_path / "store").glob("*/summary.json")).write_bytes(b"{}")
    store.keep(JOB, tmp_path / "made")
    assert store.restore(JOB, tmp_path / "out") and (tmp_path / "out" / "summary.json").read_bytes() == FILES["summary.json"]
    assert len(list((tmp_path / "store").iterdir())) == 1


def test_a_run_whose_log_stayed_elsewhere_is_not_kept(tmp_path):
    store = Store(tmp_path / "store", "v")
    store.keep(JOB, run_in(tmp_path / "made", **{"log_is_at.txt": b"host:/tmp/run"}))
    assert not store.restore(JOB, tmp_path / "out")


def test_a_disk_that_fills_while_a_run_is_read_back_leaves_no_part_of_it(tmp_path, monkeypatch):
    store = Store(tmp_path / "store", "v")
    store.keep(JOB, run_in(tmp_path / "made"))
    place, left = store_module._place, iter((True, True))

    def fills(source, target):
        if next(left, None) is None:
            raise OSError(errno.ENOSPC, "No space left on device")
        place(source, target)

    monkeypatch.setattr(store_module, "_place", fills)
    assert not store.restore(JOB, tmp_path / "out") and not (tmp_path / "out").exists()


# ---- what results depend on


@pytest.fixture
def tree(tmp_path, monkeypatch):
    """A copy of the project's code and configuration, of which the version is taken."""
    for name in ("oio", "pipelines", "hardware", "conf"):
        shutil.copytree(ROOT / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(fingerprint, "ROOT", tmp_path)
    monkeypatch.setattr(fingerprint, "CONF", tmp_path / "conf")
    return tmp_path


def version():
    return version_of_everything.__wrapped__()


PATTERNS = ("conf/**/*.yaml", "oio/*/*.py", "pipelines/*.py", "hardware/*/*.py", "hardware/arms/*.xml")
UPSTREAM = sorted(path for pattern in PATTERNS for path in ROOT.glob(pattern))[::3]  # a third of them: each costs a hash of all


def test_any_line_of_any_upstream_file_changes_the_version(tree):
    before, seen = version(), set()
    for path in UPSTREAM:
        name = path.relative_to(ROOT)
        if any(name.is_relative_to(room) for room in fingerprint.NO_RESULT):
            continue
        copy = tree / name
        kept = copy.read_bytes()
        copy.write_bytes(kept + b"# a line\n")
        seen.add(version())
        copy.write_bytes(kept)
    assert len(seen) > 50 and before not in seen and version() == before


def test_what_no_number_depends_on_does_not(tree):
    before = version()
    for name in ("oio/figures/style.py", "oio/bench/table.py", "oio/sweep/sheet.py"):
        with (tree / name).open("a") as file:
            file.write("# a line\n")
    assert version() == before


def test_code_of_other_packages_counts_by_its_target(tmp_path, monkeypatch):
    package = tmp_path / "my_filters"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "mine.py").write_text("a = 1")
    monkeypatch.syspath_prepend(tmp_path)
    cfg = OmegaConf.create({"ekf": {"_target_": "my_filters.mine.Mine"}, "sensor": {"_target_": "hardware.sensors.nose.Nose"}})
    assert set(input_files(cfg)) == {str(package / "__init__.py"), str(package / "mine.py")}


def test_configuration_of_other_packages_counts_as_a_folder_does(tmp_path, monkeypatch):
    package = tmp_path / "my_plugin" / "conf"
    package.mkdir(parents=True)
    for folder in (package, package.parent):
        (folder / "__init__.py").write_text("")
    (package / "mine.yaml").write_text("a: 1")
    monkeypatch.syspath_prepend(tmp_path)
    folders = folders_of(["pkg://my_plugin.conf", f"file://{tmp_path}", "pkg://not.there"])
    assert folders == (package, tmp_path)
    before = version_of_everything.__wrapped__(folders[:1])
    (package / "mine.yaml").write_text("a: 2")
    assert version_of_everything.__wrapped__(folders[:1]) != before


# ---- as a user types it


def sweep(folder, store, *given):
    words = ("sensor=ndir", "seed=0,1", "stage=[warm_up,baseline]", f"hydra.sweep.dir={folder}", *given)
    environment = {**os.environ, "OIO_CACHE": str(store)}
    line = [sys.executable, "-m", "oio.run", "-m", *words]
    return subprocess.run(line, cwd=ROOT, capture_output=True, text=True, timeout=300, check=False, env=environment)


def test_the_second_sweep_is_taken_from_the_first_and_says_so(tmp_path):
    store = tmp_path / "store"
    first, second, third = sweep(tmp_path / "a", store), sweep(tmp_path / "b", store), sweep(tmp_path / "c", store, "cache=off")
    assert (first.returncode, second.returncode, third.returncode) == (0, 0, 0), first.stderr
    assert "2 jobs are as in an earlier sweep" in second.stderr and "earlier sweep" not in first.stderr + third.stderr
    for path in (tmp_path / "a").glob("*/*"):
        name = path.relative_to(tmp_path / "a")
        assert (tmp_path / "b" / name).read_bytes() == path.read_bytes()
    logs = [tmp_path / name / "0_ndir_5dof_seed0" / "run.mcap" for name in "abc"]
    assert logs[1].stat().st_ino == logs[0].stat().st_ino != logs[2].stat().st_ino


def test_a_wrong_word_for_the_cache(tmp_path):
    done = sweep(tmp_path / "a", tmp_path / "store", "cache=maybe")
    assert done.returncode == 2 and "cache can be on or off" in done.stderr
