"""How a search ends: its last word is that of a map of everything, and the filters that are scored hear it too."""

import math
from dataclasses import replace

import numpy as np
import pytest

from hardware.sensors.nose import Nose
from oio.bench.trial import experiment
from oio.calibration import Navigation
from oio.errors import WorldEnded
from oio.log import MemoryLog
from oio.odometry import Odometry
from oio.pipeline import run_stages
from oio.records import seconds
from oio.stop import StopRule
from oio.summary import Evaluation

WORDS = (
    "sensor=ndir", "air=steady", "dof=3", "stage.calibrate_bouts.moves_per_rung=1", "stage.map_beliefs.repeats=2",
    "stage.map_beliefs.budget_s=0", "stage.navigate.explore=4", "stage.navigate.smelt=0",
    "stage.navigate.remap=1.5", "stage.navigate.recheck=100",
)  # fmt: skip


def searched(out, *words, world_of=lambda world: world):
    built = experiment((*WORDS, *words), 3)
    with built.backend.open() as world:
        results = run_stages(built.stages, world_of(world), built.arm, MemoryLog(), out, 3)
    return results[Navigation], results[Evaluation]


@pytest.fixture
def located(monkeypatch):
    """After how many moves maps were made live."""
    made, locate = [], Odometry.locate

    def noted(self, measurements, known=()):
        made.append(measurements)
        return locate(self, measurements, known)

    monkeypatch.setattr(Odometry, "locate", noted)
    return made


def test_a_search_that_ends_undeclared_makes_a_last_map(tmp_path, located):
    """Due after 4, 6 and 9 moves; the search ends after 7."""
    found, scored = searched(tmp_path, "stage.navigate.max_moves=7")
    assert located[:3] == [4, 6, 7] and found.moves == 7 and not found.declared
    assert found.maps_ns == tuple(found.move_ends_ns[i - 1] for i in (4, 6, 7))
    assert scored.calibrated.believed_m == found.source_m and scored.calibrated.sd_m == found.sd_m


def test_maps_of_the_search_made_again_over_the_log_are_the_same(tmp_path, monkeypatch):
    """The scored filter takes the search's maps as they are; made anew they score the same to the bit."""
    _, taken = searched(tmp_path, "stage.navigate.max_moves=7")
    locate = Odometry.locate
    monkeypatch.setattr(Odometry, "locate", lambda self, measurements, known=(): locate(self, measurements))
    _, anew = searched(tmp_path, "stage.navigate.max_moves=7")
    assert anew.calibrated == taken.calibrated and anew.cold == taken.cold


def test_a_search_that_ends_on_a_map_makes_no_other(tmp_path, located):
    found, _ = searched(tmp_path, "stage.navigate.max_moves=6")
    assert located[:2] == [4, 6] and len(found.maps_ns) == 2


def test_a_search_that_smells_nothing_explores_longer_but_not_for_ever(tmp_path, located):
    deaf = ("stage.navigate.smelt=3", "stage.navigate.smelt_sigmas=1e6", "stage.navigate.explore_most=5")
    searched(tmp_path, "stage.navigate.max_moves=7", *deaf)
    assert located[:2] == [5, 7]


def test_what_the_last_map_declares_is_declared(tmp_path, monkeypatch):
    """The rule may hold for a map of everything though it did not for the filter: live and on the log alike."""
    monkeypatch.setattr(StopRule, "holds", lambda _, odometry, moves: len(moves) == 7 and not odometry._nis)
    found, scored = searched(tmp_path, "stage.navigate.max_moves=7")
    assert found.declared and scored.calibrated.found and scored.calibrated.moves == 7


class Ends:
    """A world that is over so many moves after the source was presented."""

    def __init__(self, world, moves):
        self._world, self._left, self._searching = world, moves, False

    def __getattr__(self, name):
        return getattr(self._world, name)

    def present(self, source):
        self._searching = source == "source"
        self._world.present(source)

    def samples(self, for_s):
        if self._searching:
            self._left -= 1
            if self._left < 0:
                raise WorldEnded("no more")
        yield from self._world.samples(for_s)


def spoilt(world, monkeypatch, every):
    """The same world; once the source was presented, readings of every so many tenths of a second are NaN."""
    read, present = Nose.reading, world.present

    def garbled(self, sample):
        sound = read(self, sample)
        return sound if round(10 * seconds(sample.t_ns)) % every else replace(sound, ppm=math.nan)

    def presented(source):
        present(source)
        if source == "source":
            monkeypatch.setattr(Nose, "reading", garbled)

    monkeypatch.setattr(world, "present", presented)
    return world


@pytest.mark.parametrize("moves", [0, 1, 2])
def test_a_world_that_ends_while_exploring_is_no_mishap(tmp_path, moves):
    found, scored = searched(tmp_path, world_of=lambda world: Ends(world, moves))
    assert found.moves == moves and len(found.maps_ns) == (moves > 0) and not found.declared
    assert np.all(np.isfinite(found.source_m)) == (moves > 0)
    assert (scored.calibrated.believed_m is None) == (moves == 0)


def test_a_search_that_has_read_nothing_ends_without_a_map(tmp_path, monkeypatch):
    """All readings are missed, and there is no time to explore."""
    found, scored = searched(tmp_path, "stage.navigate.max_s=1", world_of=lambda world: spoilt(world, monkeypatch, 1))
    assert found.maps_ns == () and not np.any(np.isfinite(found.source_m)) and scored.calibrated.believed_m is None


def test_missed_readings_leave_no_mark(tmp_path, monkeypatch):
    found, scored = searched(tmp_path, "stage.navigate.max_moves=7", world_of=lambda world: spoilt(world, monkeypatch, 3))
    assert all(math.isfinite(move.ppm) for move in found.made) and any(move.ppm > 0 for move in found.made)
    assert np.all(np.isfinite(found.source_m)) and scored.calibrated.believed_m == found.source_m
