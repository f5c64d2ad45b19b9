"""The first run after an install: everything is compiled once, by one process, and a stop ends it."""

import fcntl
import os
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from oio.cli import first_compile as tested
from oio.cli.compile_pieces import PIECES
from oio.core import interrupt

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture(autouse=True)
def nothing_shipped(monkeypatch):
    monkeypatch.setattr(tested, "use_shipped", lambda: False)


@pytest.fixture
def made(monkeypatch, tmp_path):
    """What was compiled, in an empty cache."""
    done: list[str] = []
    monkeypatch.setattr(tested, "complete_mark", lambda: tmp_path / "complete")
    monkeypatch.setattr(tested, "_compile", lambda: done.append("all"))
    return done


def test_it_compiles_once(made):
    tested.first_compile()
    tested.first_compile(quiet=True)
    assert made == ["all"]


def test_what_the_wheel_brought_is_not_compiled(made, monkeypatch):
    monkeypatch.setattr(tested, "use_shipped", lambda: True)
    tested.first_compile()
    assert made == []


def test_of_two_processes_one_compiles_and_the_other_waits(made, tmp_path):
    with (tmp_path / "compiling").open("w") as other:
        fcntl.flock(other.fileno(), fcntl.LOCK_EX)
        waiting = threading.Thread(target=tested.first_compile, args=(True,))
        waiting.start()
        waiting.join(0.3)
        assert waiting.is_alive()
        (tmp_path / "complete").touch()
    waiting.join(5.0)
    assert not waiting.is_alive() and made == []


def test_a_cache_that_cannot_be_written_is_none(made, monkeypatch, tmp_path):
    monkeypatch.setattr(tested, "complete_mark", lambda: tmp_path / "none" / "complete")
    tested.first_compile()
    assert made == []


def test_a_stop_ends_the_pieces_and_leaves_it_undone(monkeypatch, tmp_path):
    started = []

    class Piece(subprocess.Popen):
        def __init__(self, command, **settings):
            super().__init__([sys.executable, "-c", "import time; time.sleep(60)"], **settings)
            started.append(self)
            interrupt._asked.append(2)

    monkeypatch.setattr(tested, "complete_mark", lambda: tmp_path / "complete")
    monkeypatch.setattr(tested.subprocess, "Popen", Piece)
    monkeypatch.setattr(interrupt, "_asked", [])
    with pytest.raises(KeyboardInterrupt):
        tested.first_compile(quiet=True)
    assert len(started) == len(tested.NAMES) and all(piece.returncode is not None for piece in started)
    assert [path.name for path in tmp_path.iterdir()] == ["compiling"]


def test_the_pieces_are_those_that_are_run():
    assert set(tested.NAMES) == set(PIECES)


@pytest.mark.parametrize("piece", PIECES)
def test_a_piece_runs(piece):
    """Its errors would go unseen: what fails there compiles later."""
    PIECES[piece]()


@pytest.mark.slow
@pytest.mark.parametrize("sensor", ["ec", "ndir", "mox_mics"])
def test_a_run_after_it_compiles_nothing(sensor, tmp_path):
    env = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    compiled = "from oio.cli.first_compile import first_compile; first_compile()"
    subprocess.run([sys.executable, "-c", compiled], cwd=ROOT, env=env, check=True)
    before = len(list(tmp_path.rglob("*.nbc")))
    words = [f"sensor={sensor}", "report=false", f"hydra.run.dir={tmp_path / 'run'}"]
    subprocess.run([sys.executable, "-m", "oio.run", *words], cwd=ROOT, env=env, check=True, stdout=subprocess.DEVNULL)
    assert before > 55 and len(list(tmp_path.rglob("*.nbc"))) == before
