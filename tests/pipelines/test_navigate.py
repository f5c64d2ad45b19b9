"""How a search ends: its last word is that of a map of everything, and the filters that are scored hear it too."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hardware.sensors.nose import Nose
from oio.bench.trial import experiment
from oio.core.errors import WorldEnded
from oio.core.records import JointState, seconds
from oio.estimators.odometry import Odometry
from oio.gas.detection import WhiffDetector
from oio.log import MemoryLog
from oio.results.calibration import Navigation
from oio.results.evaluation import Evaluation
from oio.runtime.runner import run_stages
from oio.search import closed_loop
from oio.search.elsewhere import LookElsewhere
from oio.search.stop_rule import StopRule
from oio.search.view import Move

pytestmark = pytest.mark.long

WORDS = (
    "sensor=ndir", "air=steady", "dof=3", "stage.calibrate_bouts.moves_per_rung=1", "stage.map_beliefs.repeats=2",
    "stage.map_beliefs.budget_s=0", "stage.navigate.mapping.explore_moves=4", "stage.navigate.mapping.min_whiffs=0",
    "stage.navigate.mapping.remap_factor=1.5", "stage.navigate.mapping.recheck_moves=100",
)  # fmt: skip


def searched(out, *words, world_of=lambda world: world, strategy_of=lambda search: search):
    built = experiment((*WORDS, *words), 3)
    search = built.stages["navigate"]
    stages = {**built.stages, "navigate": replace(search, search=strategy_of(search.search))}
    with built.backend.open() as world:
        results = run_stages(stages, world_of(world), built.arm, MemoryLog(), out, 3)
    return results[Navigation], results[Evaluation]


@pytest.fixture
def located(monkeypatch):
    """After how many moves maps were made live."""
    made, locate = [], Odometry.locate

    def noted(self, measurements, known=(), thorough=True):
        made.append(measurements)
        return locate(self, measurements, known, thorough)

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
    plain = "stage.navigate.max_moves=7", "belief_map.alternatives.worlds=[]"  # alternatives are fitted by the search alone
    _, taken = searched(tmp_path, *plain)
    locate = Odometry.locate
    monkeypatch.setattr(Odometry, "locate", lambda self, measurements, known=(), thorough=True: locate(self, measurements))
    _, anew = searched(tmp_path, *plain)
    assert anew.calibrated == taken.calibrated and anew.cold == taken.cold


def test_a_search_that_ends_on_a_map_makes_no_other(tmp_path, located):
    found, _ = searched(tmp_path, "stage.navigate.max_moves=6")
    assert located[:2] == [4, 6] and len(found.maps_ns) == 2


def test_a_search_that_smells_nothing_explores_longer_but_not_for_ever(tmp_path, located):
    deaf = ("stage.navigate.mapping.min_whiffs=3", "stage.navigate.whiff_sigmas=1e6", "stage.navigate.mapping.explore_max_moves=5")
    searched(tmp_path, "stage.navigate.max_moves=7", *deaf)
    assert located[:2] == [5, 7]


def test_what_the_last_map_declares_is_declared(tmp_path, monkeypatch):
    """The rule may hold for a map of everything though it did not for the filter: live and on the log alike."""
    locate, reading, mapped = Odometry.locate, Odometry.reading, set()

    def located(self, *known, **how):
        fits = locate(self, *known, **how)
        mapped.add(id(self))
        return fits

    def read(self, sensed):
        mapped.discard(id(self))
        return reading(self, sensed)

    monkeypatch.setattr(Odometry, "locate", located)
    monkeypatch.setattr(Odometry, "reading", read)
    monkeypatch.setattr(StopRule, "may_declare", lambda _, odometry, moves: len(moves) == 7 and id(odometry) in mapped)
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
        if self._searching and for_s > 0.0:
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


class Scripted(WhiffDetector):
    """Says of the moves that it smelt something, or that the sensor was as in clean air."""

    script = ""  # a letter per move: s smelt, . silent, - neither: something is left of an earlier sniff

    def __init__(self, baselines, fall_s):
        self._moves = -1  # the first move begins after the beginning itself
        super().__init__(baselines, fall_s)

    def begin(self):
        super().begin()
        self._moves += 1

    def feed(self, sensed):
        super().feed(sensed)
        if isinstance(sensed, JointState):
            self._seen = sensed.q
        letter = self.script[self._moves - 1]
        self.fresh, self.level, self.q = {"s": (1e3, 1e3, self._seen), ".": (0.0, 0.0, None), "-": (0.0, 1e3, None)}[letter]


class Shown:
    """A strategy, and whether every view it was shown had a belief and hypotheses."""

    def __init__(self, search):
        self._strategy, self.believed = search, []

    def propose(self, view, rng):
        assert (view.belief is None) == (view.hypotheses == ())
        self.believed.append(view.belief is not None)
        return self._strategy.propose(view, rng)


def told(out, monkeypatch, script, *words):
    """A search that is told what it smelt and never declares: shown a belief before every move, and after which moves maps were made."""
    monkeypatch.setattr(closed_loop, "WhiffDetector", type("Told", (Scripted,), {"script": script}))
    monkeypatch.setattr(StopRule, "may_declare", lambda *_: False)
    monkeypatch.setattr(LookElsewhere, "propose", lambda *_: None)  # which would go before the strategy
    shown = []

    def strategy_of(search):
        shown.append(Shown(search))
        return shown[0]

    found, _ = searched(
        out, "stage.navigate.mapping.remap_factor=100", f"stage.navigate.max_moves={len(script)}", *words, strategy_of=strategy_of
    )
    return shown[0].believed, [found.move_ends_ns.index(t_ns) + 1 for t_ns in found.maps_ns], found


def test_who_has_lost_the_plume_is_shown_no_belief_and_maps_again_when_it_smells(tmp_path, monkeypatch):
    """First map after four moves; silent are the seventh, eighth and ninth; the tenth smells; the last map is the last word."""
    believed, maps, found = told(tmp_path, monkeypatch, "ssssss...sss", "stage.navigate.mapping.lost_moves=2")
    assert believed == [False] * 4 + [True] * 4 + [False] * 2 + [True] * 2
    assert maps == [4, 10, 12]
    assert [move.silent for move in found.made] == [letter == "." for letter in "ssssss...sss"]
    assert [move.whiff_q is not None for move in found.made] == [letter == "s" for letter in "ssssss...sss"]


def test_fewer_silent_moves_are_no_loss(tmp_path, monkeypatch):
    believed, maps, _ = told(tmp_path, monkeypatch, "ssss...s", "stage.navigate.mapping.lost_moves=4")
    assert believed == [False] * 4 + [True] * 4 and maps == [4, 8]


def test_a_leftover_is_neither_a_smell_nor_silence(tmp_path, monkeypatch):
    """It does not end the exploring, and it does not say that the plume is lost."""
    believed, maps, found = told(
        tmp_path, monkeypatch, "s----ss-", "stage.navigate.mapping.lost_moves=2", "stage.navigate.mapping.min_whiffs=3"
    )
    assert believed == [False] * 7 + [True] and maps == [7, 8]
    assert not any(move.silent for move in found.made)


@given(silent=st.lists(st.booleans(), max_size=12), lost=st.integers(1, 5))
def test_lost_is_so_many_silent_moves_in_a_row_at_the_end(built, silent, lost):
    policy = replace(built("stage", "stage=[navigate]")["navigate"].mapping, lost_moves=lost)
    moves = tuple(Move(np.zeros(3), 0.0, 0.0, None, one) for one in silent)
    ends = len(silent) - max((i + 1 for i, one in enumerate(silent) if not one), default=0)
    assert policy.lost(moves) == (ends >= lost)


@pytest.mark.parametrize("sensor", ["ndir", "ec", "mox_mics"])
def test_what_the_beacon_left_in_the_sensor_is_not_smelt(tmp_path, sensor):
    """A search for a source that lets out next to nothing: the signal of the beacon is there for moves, and falls."""
    quiet = (f"sensor={sensor}", "source.strength=1e-6", "stage.navigate.max_moves=6")
    found, _ = searched(tmp_path, *quiet)
    assert not any(move.whiff_q is not None for move in found.made)
    assert not found.made[0].silent and not found.declared
