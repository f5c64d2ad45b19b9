"""The recorder of a move: who hears of a reading, and in which order."""

from types import SimpleNamespace

import pytest

from oio.core.records import GasReading
from oio.search.move_recorder import MoveRecorder


@pytest.mark.parametrize(
    ("innovation", "heard"), [(None, ["filter", "bouts", "whiffs"]), (object(), ["filter", "belief", "bouts", "whiffs"])]
)
def test_a_belief_is_told_before_anything_else_is_done(innovation, heard):
    """The account of a live world ends there. Before the first map there is none."""
    told = []
    recorder = MoveRecorder(
        SimpleNamespace(reading=lambda reading: told.append("filter") or innovation),
        SimpleNamespace(feed=lambda reading: told.append("bouts")),
        SimpleNamespace(feed=lambda reading: told.append("whiffs"), begin=lambda: None),
        3.0,
        lambda: told.append("belief"),
    )
    recorder.begin()
    assert recorder.reading(GasReading(0, 0, 1.0, 0.1)) is innovation and told == heard
