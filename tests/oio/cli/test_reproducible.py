"""A run is called reproducible only if its code is a commit, its packages are the lock's and its devices said who they are."""

import json
import os
import subprocess
from importlib import metadata

import pytest

from oio.cli import git_state, lock_file
from oio.cli.build import build
from oio.cli.compose import compose
from oio.cli.execute import execute
from oio.cli.reproducible import reproducible
from oio.log import read_metadata


@pytest.fixture
def clean(monkeypatch):
    """A tree without changes, and packages as locked."""
    monkeypatch.setattr(git_state, "in_git", lambda: True)
    monkeypatch.setattr(git_state, "uncommitted", tuple)
    monkeypatch.setattr(lock_file, "differing", tuple)
    return monkeypatch


def test_a_clean_tree_with_the_locked_packages_is_reproducible(clean):
    assert (reproducible({}).word, reproducible({}).reasons) == ("yes", ())
    assert reproducible({"backend.nose": "SCD30, firmware 3.66"}).word == "yes"


def test_each_reason_is_said(clean):
    clean.setattr(git_state, "uncommitted", lambda: ("a.py", "b.py", "c.py", "d.py", "e.py"))
    assert reproducible({}).reasons == ("the git tree has changes that are not committed: a.py; b.py; c.py; and 2 more",)
    clean.setattr(lock_file, "differing", lambda: ("numpy 1, locked 2",))
    assert reproducible({"backend.nose": None, "backend.arm": "servos"}).reasons[1:] == (
        "packages are not those of requirements.lock: numpy 1, locked 2",
        "backend.nose said nothing of itself",
    )
    clean.setattr(lock_file, "differing", lambda: None)
    clean.setattr(git_state, "in_git", lambda: False)
    told = reproducible({})
    assert told.word == "no" and told.reasons == (
        "the code is in no git tree, so no commit names it",
        "there is no requirements.lock beside the code",
    )


def test_the_lock_is_compared_with_what_is_installed_and_no_more(tmp_path):
    numpy, lock = metadata.version("numpy"), tmp_path / "requirements.lock"
    lock.write_text(f"# a comment\nNumPy=={numpy} ; python_full_version < '3.12' \\\n    --hash=sha256:0\nnot-installed==1.0 \\\n")
    assert lock_file.differing(lock) == ()
    other = tmp_path / "other.lock"
    other.write_text(
        f"numpy==0.1 ; python_full_version < '3.12' \\\nnumpy==0.2 ; python_full_version >= '3.12' \\\nmcap=={metadata.version('mcap')}\n"
    )
    assert lock_file.differing(other) == (f"numpy {numpy}, locked 0.1 or 0.2",)
    assert lock_file.differing(tmp_path / "none.lock") is None


def test_the_projects_own_lock_is_read_whole():
    pinned = lock_file.pinned(lock_file.LOCK)
    assert {"numpy", "hydra-core", "mujoco", "mcap"} <= set(pinned) and len(pinned) > 30
    assert len(pinned["numpy"]) == 2  # by the version of Python


@pytest.fixture
def tree(tmp_path, monkeypatch):
    """A git tree of its own, committed, in place of the project's."""
    (tmp_path / "oio").mkdir()
    (tmp_path / "oio" / "a.py").write_text("1")
    author = ["-c", "user.name=a", "-c", "user.email=a@b"]
    for words in (["init", "-q"], ["add", "."], [*author, "commit", "-qm", "first"]):
        subprocess.run(["git", *words], cwd=tmp_path, check=True)
    monkeypatch.setattr(git_state, "ROOT", tmp_path)

    def fresh():
        git_state._entries.cache_clear()
        git_state.commit.cache_clear()
        return git_state.uncommitted()

    yield tmp_path, fresh
    git_state._entries.cache_clear()
    git_state.commit.cache_clear()


def test_changed_files_and_new_code_make_a_tree_dirty_and_notes_do_not(tree):
    folder, fresh = tree
    assert fresh() == () and not git_state.commit().endswith("-dirty")
    (folder / "answers.yaml").write_text("a: 1")
    assert fresh() == ()
    (folder / "oio" / "b.py").write_text("2")
    assert fresh() == ("oio/b.py",)
    (folder / "oio" / "a.py").write_text("3")
    assert fresh() == ("oio/a.py", "oio/b.py") and git_state.commit().endswith("-dirty")


def test_asking_writes_nothing_to_the_repository(tree):
    """A run that is killed while it asks would leave a lock there, and nobody could commit."""
    folder, fresh = tree
    os.utime(folder / "oio" / "a.py", (1, 1))  # git would refresh its index
    index = folder / ".git" / "index"
    before = index.stat().st_mtime_ns, index.read_bytes()
    assert fresh() == () and not git_state.commit().endswith("-dirty")
    assert (index.stat().st_mtime_ns, index.read_bytes()) == before


def test_the_block_is_in_the_summary_and_in_the_log(clean, tmp_path):
    composed = compose(("sensor=ndir", "dof=1", "stage=[warm_up]"), ())
    document = execute(build(composed.cfg, composed.choices, []), tmp_path / "run", quiet=True)
    assert document["reproducible"] == {"word": "yes", "reasons": []}
    about = read_metadata(tmp_path / "run" / "run.mcap")
    assert json.loads(about["reproducible"]) == document["reproducible"] and json.loads(about["devices"]) == {}
