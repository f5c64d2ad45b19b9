"""A command whose output nobody reads ends without a word; one whose output cannot be written says so."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from oio.core.standard_output import ended

ROOT = Path(__file__).resolve().parents[3]
HELP = (("oio.run", "--help"), ("oio.run", "--version"), ("oio", "--help"), ("oio.compare", "--help"), ("hardware.ports", "--help"))
DONE = (0, 141)


@pytest.mark.parametrize(("module", "word"), HELP)
@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_nobody_reads(module, word, unbuffered):
    read, write = os.pipe()
    os.close(read)
    env = {**os.environ, "PYTHONUNBUFFERED": unbuffered}
    done = subprocess.run([sys.executable, "-m", module, word], cwd=ROOT, env=env, stdout=write, stderr=subprocess.PIPE, check=False)
    os.close(write)
    assert done.returncode in DONE and done.stderr == b""


def test_nobody_reads_a_table(tmp_path):
    """Rich would end with 1."""
    (tmp_path / "my.csv").write_text("t [s],co2 [ppm]\n" + "".join(f"{t},{400 + t % 3}\n" for t in range(20)))
    read, write = os.pipe()
    os.close(read)
    line = [sys.executable, "-m", "oio.inspect", str(tmp_path / "my.csv")]
    done = subprocess.run(line, cwd=ROOT, stdout=write, stderr=subprocess.PIPE, check=False)
    os.close(write)
    assert (done.returncode, done.stderr) == (141, b"")


def test_a_device_that_is_full():
    with Path("/dev/full").open("w", encoding="utf-8") as full:
        line = [sys.executable, "-m", "oio.run", "--version"]
        done = subprocess.run(line, cwd=ROOT, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert (done.returncode, done.stderr) == (1, "oio: standard output cannot be written: no space left on device.\n")


@pytest.mark.parametrize("word", ["--help", "--version"])
def test_a_closed_output(word):
    line = [sys.executable, "-m", "oio", word]
    done = subprocess.run(line, cwd=ROOT, stderr=subprocess.PIPE, preexec_fn=lambda: os.close(1), check=False)
    assert (done.returncode, done.stderr) == (0, b"")


def test_a_pipe_of_something_else_is_not_hidden():
    def command():
        raise BrokenPipeError(32, "of a device")

    with pytest.raises(BrokenPipeError, match="device"):
        ended(command)


def test_codes_and_exits_pass():
    assert ended(lambda: 3) == 3
    with pytest.raises(SystemExit):
        ended(lambda: sys.exit(2))
