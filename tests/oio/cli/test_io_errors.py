"""Files and disks that cannot be written end in one paragraph: what it was, what is kept, what to type."""

import errno
import os
import resource
import subprocess
import sys
from pathlib import Path

import pytest

from oio.cli.hydra_errors import known_error
from oio.cli.io_errors import disk_full, io_error
from oio.core.errors import BadInput, OioError
from oio.core.folders import CONF

ROOT = Path(__file__).resolve().parents[3]


def failed(code, path=None):
    return OSError(code, os.strerror(code), path)


@pytest.mark.parametrize("code", [errno.EACCES, errno.EROFS, errno.ENOTDIR, errno.ENOENT])
def test_a_path_that_cannot_be_used_is_bad_input(code):
    known = known_error(failed(code, "/proc/x"), CONF)
    assert isinstance(known, BadInput)
    assert str(known).startswith(f"/proc/x cannot be used: {os.strerror(code).lower()}. Give a file or folder")


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EDQUOT, errno.EFBIG])
def test_no_room_is_a_failure_and_no_bad_input(code):
    known = known_error(failed(code), CONF)
    assert type(known) is OioError and "Make room" in str(known)


def test_what_names_no_file_keeps_its_trace():
    assert io_error(failed(errno.EPIPE)) is None
    assert known_error(failed(errno.EIO), CONF) is None
    assert io_error(ValueError("no")) is None


def test_a_run_says_what_is_kept(tmp_path):
    assert "Nothing is kept" in str(disk_full(failed(errno.ENOSPC), tmp_path))
    (tmp_path / "run.mcap.part").touch()
    assert f"python -m oio.recover {tmp_path / 'run.mcap.part'}" in str(disk_full(failed(errno.ENOSPC), tmp_path))


def run(*words, **given):
    line = [sys.executable, "-m", "oio.run", "sensor=ndir", "stage=[warm_up]", "report=false", *words]
    return subprocess.run(line, cwd=ROOT, capture_output=True, text=True, check=False, timeout=300, **given)


def test_a_folder_that_cannot_be_made_is_refused():
    done = run("hydra.run.dir=/proc/x")
    assert done.returncode == 2
    assert done.stderr.startswith("oio: /proc/x cannot be used: no such file or directory.") and done.stderr.count("\n") == 1


def test_a_log_that_takes_no_more_ends_the_run_in_one_paragraph(tmp_path):
    """A limit on the size of a file stands for a disk that is full."""
    out, most = tmp_path / "run", 40_000
    done = run(f"hydra.run.dir={out}", preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (most, most)))
    assert done.returncode == 1, done.stderr
    assert done.stderr.startswith(f"oio: {out} takes no more: file too large") and done.stderr.count("\n") == 1
    assert "is kept. Type python -m oio.recover" in done.stderr
    assert (out / "run.mcap.part").stat().st_size > most / 2 and not (out / "run.mcap").exists()
