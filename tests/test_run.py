"""The command from outside: stopped, killed, asked for help."""

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from oio.cli import recover
from oio.cli.help import choices
from oio.core.records import GasSample
from oio.log import read_metadata, read_samples, read_stages

ROOT = Path(__file__).resolve().parents[1]
CONF = ROOT / "conf"
ENDLESS = ("sensor=ndir", "dof=3", "seed=3", "stage.calibrate_bouts.moves_per_rung=1000")
STOPPED = "oio: stopped; what was logged so far can be read (python -m oio.recover RUN/run.mcap.part).\n"
CHOICES = [(group.name, name, text) for group in sorted(CONF.iterdir()) if group.is_dir() for name, text in choices(CONF, group.name)]


@pytest.fixture
def begun(tmp_path):
    """A run in the middle of a long stage, with its directory."""
    out = tmp_path / "run"
    # a child inherits ignored signals, and whoever runs the tests in the background may ignore this one
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    line = [sys.executable, "-m", "oio.run", *ENDLESS, f"hydra.run.dir={out}"]
    running = subprocess.Popen(line, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        _until_bytes(running, out / "run.mcap.part", 200_000)
        yield running, out
    finally:
        running.kill()
        running.communicate()
        signal.signal(signal.SIGINT, before)


def _until_bytes(running, path, least):
    deadline = time.monotonic() + 60
    while not path.is_file() or path.stat().st_size < least:
        assert running.poll() is None, running.communicate()
        assert time.monotonic() < deadline, "the run writes nothing"
        time.sleep(0.05)


def status(out):
    return json.loads((out / "status.json").read_text(encoding="utf-8"))


def assert_recoverable(out, capsys, codes):
    """The part becomes a log that can be read, with its beginning whole."""
    assert not (out / "run.mcap").exists()
    assert recover.main([str(out / "run.mcap.part")]) in codes
    assert "messages kept" in capsys.readouterr().out
    log = out / "run.mcap"
    assert read_metadata(log)["sensor"] == "ndir"
    sniffs = [sample.t_ns for sample in read_samples(log) if isinstance(sample, GasSample)]
    assert len(sniffs) > 20 and sniffs == sorted(sniffs)
    told = [(stage, state) for _, stage, state in read_stages(log)]
    begun_and_ended = [(stage, state) for stage in ("warm_up", "baseline") for state in ("begin", "end")]
    assert told[:5] == [*begun_and_ended, ("calibrate_bouts", "begin")]
    return told


@pytest.mark.parametrize("sent", [signal.SIGINT, signal.SIGTERM], ids=["ctrl-c", "terminated"])
def test_a_stopped_run_says_so_in_one_line_and_keeps_its_log(begun, capsys, sent):
    running, out = begun
    running.send_signal(sent)
    stdout, stderr = running.communicate(timeout=30)
    assert (running.returncode, stdout, stderr) == (130, "", STOPPED)
    assert status(out)["state"] == "interrupted"
    assert status(out)["traceback"] is None
    assert not (out / "summary.json").exists()
    assert {path.name for path in out.iterdir()} == {"config.yaml", "status.json", "run.mcap.part"}
    told = assert_recoverable(out, capsys, (0, 3))
    assert told[-1] == ("calibrate_bouts", "failed")


def test_a_killed_run_keeps_its_log(begun, capsys):
    running, out = begun
    running.kill()
    running.communicate(timeout=30)
    assert status(out)["state"] == "running"
    assert_recoverable(out, capsys, (0, 3))


@pytest.mark.slow
def test_a_stopped_run_is_not_written_over(begun):
    running, out = begun
    running.terminate()
    running.communicate(timeout=30)
    kept = {path.name: path.read_bytes() for path in out.iterdir()}
    line = [sys.executable, "-m", "oio.run", *ENDLESS, f"hydra.run.dir={out}"]
    again = subprocess.run(line, cwd=ROOT, capture_output=True, text=True, timeout=60, check=False)
    assert again.returncode == 2 and "already holds a run" in again.stderr
    assert {path.name: path.read_bytes() for path in out.iterdir()} == kept


# ---- --help


@pytest.fixture(scope="module")
def helped():
    line = [sys.executable, "-m", "oio.run", "--help"]
    return subprocess.run(line, cwd=ROOT, capture_output=True, text=True, timeout=60, check=False)


def sections(text):
    """The lines below each `group=`."""
    found, group = {}, None
    for line in text.splitlines():
        if line and not line.startswith(" "):
            group = line.split("=")[0] if "=" in line else None
        if group:
            found.setdefault(group, []).append(line)
    return found


def test_help_is_quiet_and_short(helped):
    assert (helped.returncode, helped.stderr) == (0, "")
    assert "\x1b" not in helped.stdout
    for key in ("dof=", "assembly=", "seed=", "source.position=", "beacon.position="):
        assert f"\n{key}" in helped.stdout


def test_help_lists_the_choices_of_ones_own_folder_besides(tmp_path):
    (tmp_path / "ekf").mkdir()
    (tmp_path / "ekf" / "mine.yaml").write_text("# A filter of my own.\n_target_: my_filter.Mine\n", encoding="utf-8")
    line = [sys.executable, "-m", "oio.run", "--config-dir", str(tmp_path), "--help"]
    said = subprocess.run(line, cwd=ROOT, capture_output=True, text=True, timeout=60, check=True).stdout
    assert "  mine          A filter of my own." in said and "  fixed_lag" in said


@pytest.mark.parametrize(("group", "name", "text"), CHOICES, ids=[f"{group}={name}" for group, name, _ in CHOICES])
def test_help_lists_every_choice_with_its_words(helped, group, name, text):
    lines = sections(helped.stdout)[group]
    assert any(line.split()[:1] == [name] for line in lines[1:])
    assert text and " ".join(text.split()) in " ".join(" ".join(lines).split())


@pytest.mark.parametrize(("group", "name"), [(group, name) for group, name, _ in CHOICES])
def test_help_says_one_whole_sentence(group, name):
    text = dict(choices(CONF, group))[name]
    assert text.endswith(".") and ". " not in text


def test_every_line_of_the_examples_is_a_command_that_exists(helped):
    for line in helped.stdout.splitlines():
        if line.startswith("  python -m oio."):
            module = line.split()[2]
            assert any((ROOT / Path(*module.split("."))).with_suffix(suffix).exists() for suffix in (".py", ""))
