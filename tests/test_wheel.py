"""The wheel and the sdist are whole: installed alone, the program runs from an empty folder."""

import os
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

pytestmark = pytest.mark.long

ROOT = Path(__file__).resolve().parents[1]


def built(kind: str, root: Path, out: Path, **env: str) -> Path:
    """A wheel or an sdist of a source tree."""
    line = [sys.executable, "-m", "hatchling", "build", "-t", kind, "-d", str(out)]
    subprocess.run(line, cwd=root, check=True, capture_output=True, env={**os.environ, **env})
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


@pytest.mark.slow
def test_with_its_compiled_code_the_first_run_compiles_nothing(tmp_path):
    """As `make wheel` does it: 40 s less for whoever installs it."""
    code, installed, cache = tmp_path / "code", tmp_path / "installed", tmp_path / "cache"
    subprocess.run([sys.executable, "-m", "oio.cli.ship_compiled", str(code)], cwd=ROOT, check=True)
    wheel = built("wheel", ROOT, tmp_path / "wheel", OIO_COMPILED=str(code))
    assert f"-cp{sys.version_info.major}{sys.version_info.minor}-" in wheel.name and wheel.stat().st_size < 5e6
    with zipfile.ZipFile(wheel) as packed:
        packed.extractall(installed)
    where = {**os.environ, "PYTHONPATH": str(installed), "NUMBA_CACHE_DIR": str(cache)}
    shipped = {path.name for path in installed.rglob("*.nbc")}
    assert len(shipped) > 55
    for words in (["sensor=ec", "dof=5"], ["sensor=ndir", "dof=3", "air=draft"]):
        line = [sys.executable, "-P", "-m", "oio", *words, "report=false", "stage.navigate.max_moves=20"]
        done = subprocess.run(line, cwd=tmp_path, env=where, capture_output=True, text=True, check=False)
        assert done.returncode in (0, 3), done.stderr
        assert "compiling" not in done.stderr
        assert {path.name for path in cache.rglob("*.nbc")} == shipped
