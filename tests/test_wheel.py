"""The wheel and the sdist are whole: installed alone, the program runs from an empty folder."""

import os
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


def built(kind: str, root: Path, out: Path) -> Path:
    """A wheel or an sdist of a source tree."""
    line = [sys.executable, "-m", "hatchling", "build", "-t", kind, "-d", str(out)]
    subprocess.run(line, cwd=root, check=True, capture_output=True)
    (made,) = out.iterdir()
    return made


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    return built("wheel", ROOT, tmp_path_factory.mktemp("wheel"))


def test_it_runs_from_an_empty_folder(wheel, tmp_path):
    installed, empty = tmp_path / "installed", tmp_path / "empty"
    with zipfile.ZipFile(wheel) as packed:
        packed.extractall(installed)
    empty.mkdir()
    where = {**os.environ, "PYTHONPATH": str(installed), "NUMBA_CACHE_DIR": str(tmp_path / "compiled")}
    asked = [sys.executable, "-P", "-c", "import oio, hardware, pipelines; print(oio.__file__, hardware.__file__, pipelines.__file__)"]
    found = subprocess.run(asked, cwd=empty, env=where, capture_output=True, text=True, check=True).stdout.split()
    assert all(path.startswith(str(installed)) for path in found)
    line = [sys.executable, "-P", "-m", "oio", "sensor=ndir", "stage=[warm_up,baseline]", "report=false"]
    done = subprocess.run(line, cwd=empty, env=where, capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 0, done.stderr
    assert [path.name for path in empty.iterdir()] == ["outputs"]
    completed = subprocess.run(
        [sys.executable, "-P", "-m", "oio", "--complete", "oio sensor=mo"], cwd=empty, env=where, capture_output=True, text=True
    )
    assert completed.stdout == "sensor=mox_mics\nsensor=mox_mq\n"


def test_a_wheel_of_the_sdist_is_the_same_wheel(wheel, tmp_path):
    sdist = built("sdist", ROOT, tmp_path / "sdist")
    with tarfile.open(sdist) as packed:
        packed.extractall(tmp_path / "source", filter="data")
    (source,) = (tmp_path / "source").iterdir()
    again = built("wheel", source, tmp_path / "again")
    with zipfile.ZipFile(wheel) as one, zipfile.ZipFile(again) as other:
        assert one.namelist() == other.namelist()
        assert all(one.read(name) == other.read(name) for name in one.namelist())
    assert (source / "Makefile").is_file() and (source / "tests" / "conftest.py").is_file()
