"""Stages in order, results once; the world as stages see it is logged first, guarded, and tells no truth."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

from oio.core.errors import BadInput
from oio.core.records import Event, GasReading, GasSample, JointState, Truth
from oio.log import RunLog, read_samples
from oio.motion.guard_account import GuardAccount
from oio.runtime import guarded_world
from oio.runtime.context import Context, sniff
from oio.runtime.guarded_world import GuardedWorld
from oio.runtime.runner import check_order, result_type, run_stages
from oio.testing import check_stage


class First: ...


class Second: ...


@dataclass(frozen=True)
class GivesFirst:
    """Needs nothing."""

    needs: ClassVar[tuple[type, ...]] = ()

    def run(self, context: Context) -> First:
        context.world.present("beacon")
        self.drawn.append(context.rng.standard_normal())
        return First()

    drawn: ClassVar[list[float]] = []


@dataclass(frozen=True)
class GivesSecond:
    """Needs the first."""

    needs: ClassVar[tuple[type, ...]] = (First,)

    def run(self, context: Context) -> Second:
        assert isinstance(context.need(First), First)
        self.drawn.append(context.rng.standard_normal())
        return Second()

    drawn: ClassVar[list[float]] = []


class Third: ...


@dataclass(frozen=True)
class Between:
    """Draws much and gives a third."""

    needs: ClassVar[tuple[type, ...]] = ()

    def run(self, context: Context) -> Third:
        context.rng.standard_normal(100)
        return Third()


@dataclass(frozen=True)
class GivesNothing:
    """Forgets its annotation."""

    needs: ClassVar[tuple[type, ...]] = ()

    def run(self, context): ...


@dataclass(frozen=True)
class GivesNone:
    """Says that it gives nothing."""

    needs: ClassVar[tuple[type, ...]] = ()

    def run(self, context: Context) -> None: ...


def test_a_good_order_passes():
    check_order({"one": GivesFirst(), "two": GivesSecond()})
    check_order({})
    assert result_type(GivesSecond()) is Second


@pytest.mark.parametrize(
    ("stages", "said"),
    [
        (
            {"two": GivesSecond()},
            r"'two' needs First, but no stage before it gives one: the order is \['two'\].*Add the stage that gives it",
        ),
        ({"two": GivesSecond(), "one": GivesFirst()}, r"'two' needs First.*the order is \['two', 'one'\].*Put 'one' earlier"),
        ({"one": GivesFirst(), "uno": GivesFirst()}, "stages 'one' and 'uno' both give First. Leave one of them out"),
        ({"none": GivesNothing()}, "GivesNothing.run must be annotated with the class of its result"),
    ],
)
def test_a_bad_order_is_refused_in_words(stages, said):
    with pytest.raises(BadInput, match=said):
        check_order(stages)


def test_check_stage_finds_what_is_missing():
    check_stage(GivesFirst())
    for stage, said in ((GivesNothing(), "must be annotated"), (GivesNone(), "gives something")):
        with pytest.raises(AssertionError, match=said):
            check_stage(stage)


class World:
    """Ticks of 0.1 s: joints, truth, gas."""

    def __init__(self, journal, arm):
        self.journal, self._arm, self._ticks = journal, arm, 0

    @property
    def t_ns(self):
        return self._ticks * 100_000_000

    def samples(self, for_s) -> Iterator[object]:
        n = self._arm.dof
        for _ in range(round(for_s * 10)):
            self._ticks += 1
            yield JointState(self.t_ns, self._arm.home, np.zeros(n), np.zeros(n))
            yield Truth(self.t_ns, self._arm.home, np.zeros(3), np.full(3, np.nan), 400.0)
            yield Event(self.t_ns, "dropped", "one frame")
            yield GasSample(self.t_ns, 0, 420.0)

    def move(self, q_rad, over_s):
        self.journal.append(("moved", q_rad, over_s))
        return over_s

    def present(self, source):
        self.journal.append(("presented", source))


class Log:
    """Notes what is written, in one journal with the world and the stage."""

    def __init__(self, journal):
        self.journal = journal

    def write(self, record):
        self.journal.append(("logged", record))

    def reading(self, reading):
        self.journal.append(("logged", reading))


@pytest.fixture
def watched(built):
    journal = []
    arm = built("arm", "dof=3")
    return GuardedWorld(World(journal, arm), arm, Log(journal)), journal, arm


def test_gas_at_the_upper_rail_goes_to_the_log_and_to_no_stage(built):
    journal, arm = [], built("arm", "dof=3")
    for highest_raw, seen in ((420.0, 0), (420.1, 3)):
        samples = list(GuardedWorld(World(journal, arm), arm, Log(journal), highest_raw).samples(0.3))
        assert sum(isinstance(s, GasSample) for s in samples) == seen
    assert sum(isinstance(record, GasSample) for _, record in journal) == 6


def test_every_sample_is_logged_before_a_stage_sees_it(watched):
    world, journal, _ = watched
    for sample in world.samples(0.3):
        assert journal[-1] == ("logged", sample)
        journal.append(("seen", sample))
    kinds = [type(record).__name__ for what, record in journal if what == "logged"]
    assert kinds == ["Event", *["JointState", "Truth", "Event", "GasSample"] * 3]


def test_the_account_of_a_guard_goes_to_the_log_and_a_world_without_one_has_none(watched, built):
    world, journal, arm = watched
    assert world.guard_account() is None and journal == []
    account = GuardAccount((), 0.3, 0.8, ())
    guarded = World(journal, arm)
    guarded.guard_account = lambda: account
    assert GuardedWorld(guarded, arm, Log(journal)).guard_account() == account
    ((_, event),) = journal
    assert event.kind == "guard" and GuardAccount.from_json(event.text) == account


def test_gas_and_joints_are_noted_until_the_end(watched):
    world, _, _ = watched
    list(world.samples(0.5))
    gaps = world.gaps()
    assert (gaps.due, gaps.interval_s, gaps.joints_after_s) == (5, 0.1, 0.0)


def test_no_stage_sees_truth_or_events(watched):
    assert {type(s) for s in watched[0].samples(0.5)} == {JointState, GasSample}


def test_the_length_of_a_span_is_logged_exactly(watched):
    world, journal, _ = watched
    list(world.samples(0.1 + 0.2))
    assert float(journal[0][1].text) == 0.1 + 0.2 and journal[0][1].kind == "span"


def test_a_move_is_logged_and_lasts_as_long_as_the_arm_needs(watched):
    world, journal, arm = watched
    goal = arm.home + 0.1
    assert world.move(goal) == arm.duration_s(arm.home, goal)
    assert [what for what, *_ in journal] == ["logged", "moved"]
    np.testing.assert_array_equal(world.goal, goal)
    assert world.move(goal) == 0.1  # there already


@pytest.mark.parametrize(("to", "said"), [(np.nan, "finite number"), (np.inf, "finite number"), (3.0, "joints may go from")])
def test_a_bad_move_never_reaches_the_world(watched, to, said):
    world, journal, arm = watched
    with pytest.raises(BadInput, match=said):
        world.move(np.full(3, to))
    assert not any(what == "moved" for what, *_ in journal)
    np.testing.assert_array_equal(world.goal, arm.home)


def test_presenting_is_logged_before_it_happens(watched):
    world, journal, _ = watched
    world.present("source")
    assert [what for what, *_ in journal][:2] == ["logged", "presented"]


def test_sniff_reads_gas_the_whole_way_and_logs_the_readings(watched, built, tmp_path):
    world, journal, arm = watched
    context = Context(world, Log(journal), np.random.default_rng(0), tmp_path, {})
    goal = arm.home + 0.1
    sensed = list(sniff(context, built("sensor", "sensor=ndir"), goal, 1.0))
    over_s = arm.duration_s(arm.home, goal)
    assert {type(s) for s in sensed} == {JointState, GasReading}
    readings = [s for s in sensed if isinstance(s, GasReading)]
    assert len(readings) == round((over_s + 1.0) * 10) and all(r.ppm == 420.0 for r in readings)
    assert [r for what, r, *_ in journal if what == "logged" and isinstance(r, GasReading)] == readings


class Alive(World):
    """Goes on by a tick whenever somebody looks, as a bench does."""

    def samples(self, for_s):
        return super().samples(for_s or 0.1)


def test_who_waits_for_a_person_logs_what_a_living_world_senses_as_one_span(built):
    journal, arm, looks = [], built("arm", "dof=3"), []
    world = GuardedWorld(Alive(journal, arm), arm, Log(journal))
    world.attend(lambda: looks.append(world.t_ns) or len(looks) == 3)
    logged = [entry[1] for entry in journal]
    assert looks == [0, 100_000_000, 200_000_000]
    assert [e.text for e in logged if isinstance(e, Event) and e.kind == "span"] == ["0.0"]
    assert sum(isinstance(e, GasSample) for e in logged) == 3 and world.t_ns == 300_000_000  # what came until the answer, too


def test_a_stop_ends_the_waiting(built, monkeypatch):
    arm = built("arm", "dof=3")
    monkeypatch.setattr(guarded_world.interrupt, "_asked", [2])
    with pytest.raises(KeyboardInterrupt):
        GuardedWorld(World([], arm), arm, Log([])).attend(lambda: False)


def run(tmp_path, built, stages, name="run.mcap", seed=1, between=None):
    arm = built("arm", "dof=3")
    with RunLog.create(tmp_path / name, sensor="ndir", joints=arm.names, metadata={}, attachments={}) as log:
        return run_stages(stages, World([], arm), arm, log, tmp_path, seed, between=between)


def test_what_is_between_stages_is_called_around_each(tmp_path, built):
    called = []
    run(tmp_path, built, {"one": GivesFirst(), "two": GivesSecond()}, between=lambda *words: called.append(words[:2]))
    assert called == [("before", "one"), ("after", "one"), ("before", "two"), ("after", "two")]


def test_stages_run_in_order_and_their_results_are_handed_on(tmp_path, built):
    results = run(tmp_path, built, {"one": GivesFirst(), "two": GivesSecond()})
    assert set(results) == {First, Second}
    events = [r for r in read_samples(tmp_path / "run.mcap") if isinstance(r, Event)]
    assert any(e.kind == "present" and e.text == "beacon" for e in events)


def test_a_new_stage_does_not_shift_the_numbers_of_another(tmp_path, built):
    GivesSecond.drawn.clear()
    run(tmp_path, built, {"one": GivesFirst(), "two": GivesSecond()}, "a.mcap")
    run(tmp_path, built, {"one": GivesFirst(), "between": Between(), "two": GivesSecond()}, "b.mcap")
    run(tmp_path, built, {"one": GivesFirst(), "two": GivesSecond()}, "c.mcap", seed=2)
    same, as_before, other_seed = GivesSecond.drawn
    assert same == as_before != other_seed


def test_a_bad_order_runs_nothing(tmp_path, built):
    GivesFirst.drawn.clear()
    with pytest.raises(BadInput):
        run(tmp_path, built, {"one": GivesFirst(), "uno": GivesFirst()})
    assert GivesFirst.drawn == []


def test_a_move_that_was_asked_about_is_planned_once(watched, monkeypatch):
    """And planned anew once the arm was sent on: the path begins elsewhere."""
    world, _, arm = watched
    planned, real = [], guarded_world.plan
    monkeypatch.setattr(guarded_world, "plan", lambda *args: planned.append(args[1]) or real(*args))
    a, b = arm.home + np.array([0.1, 0.0, 0.0]), arm.home + np.array([0.0, 0.1, 0.0])
    over_s = world.move_s(a)
    assert world.move_s(a.copy()) == over_s and len(planned) == 1
    world.move(a)
    assert len(planned) == 1
    assert world.move_s(b) > world.move_s(a) and len(planned) == 3
    np.testing.assert_array_equal(planned, [arm.home, a, a])
