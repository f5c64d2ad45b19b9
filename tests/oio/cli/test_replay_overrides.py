"""Overrides of a replay: what the log was made with comes first, but for where its world came from."""

import json

import pytest

from oio.cli import replay_overrides
from oio.cli.replay_overrides import replayed


@pytest.fixture
def log(monkeypatch):
    """log([...]) is a log that was made with these overrides."""

    def made(overrides):
        monkeypatch.setattr(replay_overrides, "read_metadata", lambda _: {"overrides": json.dumps(overrides)})
        return ["backend=replay", "backend.log=run.mcap"]

    return made


def test_a_recording_passes_by_name_with_its_time_outs_and_without_its_file(log):
    """So that the stages wait as long as they once did; the recording itself is not read again."""
    words = ["backend=recording", "recording=airscout32", "recording.file=other.csv", "recording.warm_up_max_s=900", "sensor=pa"]
    passed = ["recording=airscout32", "recording.warm_up_max_s=900", "sensor=pa"]
    assert replayed(log(words)) == [*passed, "backend=replay", "backend.log=run.mcap"]


def test_the_command_line_has_the_last_word(log):
    given = [*log(["sensor=pa", "recording=airscout32"]), "recording=null", "sensor=ndir"]
    assert replayed(given) == given


@pytest.mark.parametrize("override", ["recording=${oc.env:HOME}", "recording=/etc/passwd", "recording._target_=os.system", "hydra.x=1"])
def test_nothing_but_plain_words_passes(log, override):
    assert replayed(log([override])) == ["backend=replay", "backend.log=run.mcap"]
