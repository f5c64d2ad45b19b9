"""A replay gives the same stages the same samples in the same groups, and says when it is asked for something else."""

import itertools
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hardware.backends.replay import Replay, ReplayedWorld
from oio.core.errors import BadInput, WorldEnded
from oio.core.interfaces import Backend
from oio.core.records import SECOND_NS, Event, GasSample, JointState, Truth, WorldSample, nanoseconds
from oio.kinematics.arm import Arm
from oio.log import RunLog, read_samples
from oio.motion.guard_account import GuardAccount
from oio.runtime.guarded_world import GuardedWorld, move_text
from oio.testing import check_backend

TICK_NS = 20_000_000
GIVE = "Give the log of an OIO run, e.g. outputs/2026-01-31/12-00-00/run.mcap."


class Ticking:
    """Counts whole ticks and so stops short of what was asked for; a gas sample each 5th tick."""

    def __init__(self) -> None:
        self._ticks = 0
        self.q = 0.0

    @property
    def t_ns(self) -> int:
        return self._ticks * TICK_NS

    def samples(self, for_s: float) -> Iterator[WorldSample]:
        until_ns = self.t_ns + nanoseconds(for_s)
        while self.t_ns + TICK_NS <= until_ns:
            self._ticks += 1
            yield JointState(self.t_ns, [self.q], [0.0], [-0.0])
            if self._ticks % 5 == 0:
                yield Truth(self.t_ns, [self.q], [0.0] * 3, [np.nan] * 3, 5.0)
                yield GasSample(self.t_ns, 0, 0.1 * self._ticks)

    def move(self, q_rad: Any, over_s: float) -> None:
        self.q = float(q_rad[0])

    def present(self, source: str) -> None: ...


class Early(Ticking):
    """Its spans are closed below and open above, and begin with where the joints are."""

    def __init__(self) -> None:
        super().__init__()
        self._t_ns = 0

    @property
    def t_ns(self) -> int:
        return self._t_ns

    def samples(self, for_s: float) -> Iterator[WorldSample]:
        until_ns = self._t_ns + nanoseconds(for_s)
        yield JointState(self._t_ns, [self.q], [0.0], [0.0])
        while self._ticks * TICK_NS < until_ns:
            self._t_ns = max(self._ticks * TICK_NS, self._t_ns)
            self._ticks += 1
            yield GasSample(self._t_ns, 0, 0.1 * self._ticks)
        self._t_ns = until_ns


class Spoken:
    """A world whose samples and commands go to the log as a run's do, spans included."""

    def __init__(self, world: Any, log: RunLog) -> None:
        self._world, self._log = world, log
        self.seen: list[list[Any]] = []

    def samples(self, for_s: float, stop_after: int | None = None) -> None:
        self._log.write(Event(self._world.t_ns, "span", repr(float(for_s))))
        group: list[Any] = []
        for sample in itertools.islice(self._world.samples(for_s), stop_after):
            self._log.write(sample)
            group.append(bits(sample))
        self.seen.append([self._world.t_ns, *group])

    def move(self, q: float, over_s: float) -> None:
        self._log.write(Event(self._world.t_ns, "move", move_text(np.array([q]), over_s)))
        self._world.move(np.array([q]), over_s)

    def present(self, source: str) -> None:
        self._log.write(Event(self._world.t_ns, "present", source))
        self._world.present(source)


def bits(record: Any) -> list[Any]:
    values = (getattr(record, name) for name in type(record).__slots__)
    return [type(record), *(np.asarray(v, dtype=float).tobytes() if isinstance(v, float | np.ndarray) else v for v in values)]


def create(path: Path) -> Any:
    return RunLog.create(path, sensor="ec", joints=("azimuth",), metadata={}, attachments={})


def played(path: Path) -> Replay:
    return Replay(log=str(path), sensor="ec", dof=1)


Run = Callable[[Spoken], None]


def record(path: Path, world: Any, run: Run) -> list[list[Any]]:
    """Run on a world with a log; the groups of samples that the run saw."""
    with create(path) as log:
        spoken = Spoken(world, log)
        with log.stage("all", lambda: world.t_ns):
            run(spoken)
    return spoken.seen


def replay(path: Path, out: Path, run: Run) -> list[list[Any]]:
    with played(path).open() as world:
        return record(out, world, run)


steps = st.lists(
    st.one_of(
        st.tuples(st.just("samples"), st.floats(0.0, 0.5)),
        st.tuples(st.just("stop"), st.floats(0.1, 0.5), st.integers(1, 12)),
        st.tuples(st.just("move"), st.floats(-1, 1), st.floats(0.1, 2)),
        st.tuples(st.just("present"), st.sampled_from(["none", "beacon"])),
    ),
    max_size=12,
)


@pytest.mark.parametrize("world", [Ticking, Early])
@settings(max_examples=40, deadline=None)
@given(steps)
def test_the_same_run_gets_the_same_groups_and_writes_the_same_log(
    tmp_path_factory: pytest.TempPathFactory, world: type, steps: list[Any]
) -> None:
    def run(spoken: Spoken) -> None:
        for what, *how in steps:
            getattr(spoken, {"stop": "samples"}.get(what, what))(*how)

    folder = tmp_path_factory.mktemp("replay")
    seen = record(folder / "first.mcap", world(), run)
    assert replay(folder / "first.mcap", folder / "second.mcap", run) == seen
    assert (folder / "first.mcap").read_bytes() == (folder / "second.mcap").read_bytes()


def test_the_words_are_those_of_the_pipeline(tmp_path: Path) -> None:
    class Home:
        home, nose_limit_m_s = np.zeros(1), 1.0
        box_low_m, box_high_m = (-1.0, -1.0, -1.0), (1.0, 1.0, 1.0)

        def nose(self, q_rad: Any) -> Any:
            return np.zeros((*np.shape(q_rad)[:-1], 3))

        def validated(self, q_rad: Any) -> Any:
            return q_rad

        def duration_s(self, q_from: Any, q_to: Any) -> float:
            return 0.12345

    def run(world: Any, path: Path) -> list[WorldSample]:
        with create(path) as log:
            watched = GuardedWorld(world, cast(Arm, Home()), log)
            watched.present("beacon")
            watched.move(np.array([1 / 3]))
            for _ in watched.samples(0.4):
                pass
        return list(read_samples(path))

    first = run(Ticking(), tmp_path / "first.mcap")
    with played(tmp_path / "first.mcap").open() as world:
        second = run(world, tmp_path / "second.mcap")
        assert world.differing == 0
    assert [bits(s) for s in first] == [bits(s) for s in second]


def logged(path: Path, marks: bool = True) -> Path:
    """One second, a move, one second; then over."""
    world = Ticking()
    with create(path) as log:
        for begins in ("present none", "move 1.0 s to [0.5]"):
            log.write(Event(world.t_ns, *begins.split(" ", 1)))
            if marks:
                log.write(Event(world.t_ns, "span", "1.0"))
            for sample in world.samples(1.0):
                log.write(sample)
        log.write(Event(world.t_ns, "progress", "done"))
    return path


def times(world: ReplayedWorld, for_s: float) -> list[int]:
    return [s.t_ns for s in world.samples(for_s) if isinstance(s, JointState)]


@pytest.mark.parametrize("marks", [True, False])
def test_spans_of_other_lengths_go_by_time(tmp_path: Path, marks: bool) -> None:
    with played(logged(tmp_path / "run.mcap", marks)).open() as world:
        assert isinstance(played(tmp_path / "run.mcap"), Backend)
        world.present("none")
        assert times(world, 0.25) == list(range(TICK_NS, 250_000_000, TICK_NS))
        assert world.t_ns == 250_000_000
        assert times(world, 0.75) == list(range(260_000_000, SECOND_NS + 1, TICK_NS))
        assert world.t_ns == SECOND_NS
        world.move(np.array([0.5]), 1.0)
        assert times(world, 1.0) == list(range(SECOND_NS + TICK_NS, 2 * SECOND_NS + 1, TICK_NS))
        assert (world.t_ns, world.differing) == (2 * SECOND_NS, 0)


def test_truth_is_played_and_events_are_not(tmp_path: Path) -> None:
    with played(logged(tmp_path / "run.mcap")).open() as world:
        world.present("none")
        kinds = [type(sample) for sample in world.samples(1.0)]
    assert {kind: kinds.count(kind) for kind in kinds} == {JointState: 50, GasSample: 10, Truth: 10}


def test_the_account_of_the_guard_is_the_last_one_before_now(tmp_path: Path) -> None:
    accounts = [GuardAccount((), speed, 0.8, ("pan",)) for speed in (0.1, 0.3)]

    def run(spoken: Spoken) -> None:
        for account in accounts:
            spoken.samples(0.3)
            spoken._log.write(Event(spoken._world.t_ns, "guard", account.to_json()))
        spoken.samples(0.3)

    record(tmp_path / "log.mcap", Ticking(), run)
    with played(tmp_path / "log.mcap").open() as world:
        given = [world.guard_account()]
        for _ in range(3):
            list(world.samples(0.3))
            given.append(world.guard_account())
    assert given == [None, *accounts, accounts[-1]]


def test_another_command_is_said_once(tmp_path: Path) -> None:
    with played(logged(tmp_path / "run.mcap")).open() as world:
        world.present("none")
        times(world, 1.0)
        world.move(np.array([0.25]), 1.0)
        world.present("beacon")
        said = [s for s in world.samples(1.0) if isinstance(s, Event)]
    assert [(event.t_ns, event.kind, event.text) for event in said] == [
        (
            SECOND_NS,
            "replay",
            "'move 1.0 s to [0.25]' was asked for where the log has 'move 1.0 s to [0.5]': "
            "from here on the samples are those of the logged path, not of the path asked for",
        )
    ]
    assert world.differing == 2


def test_commands_too_many_and_too_few(tmp_path: Path) -> None:
    path = logged(tmp_path / "run.mcap")
    with played(path).open() as world:
        said = [s for s in itertools.chain(world.samples(1.0), world.samples(1.0)) if isinstance(s, Event)]
        assert [event.text.split(":")[0] for event in said] == ["nothing was asked for where the log has 'present none'"]
        assert world.differing == 2
    with played(path).open() as world:
        world.present("none")
        world.present("beacon")
        said = [s for s in world.samples(1.0) if isinstance(s, Event)]
        assert [event.text.split(":")[0] for event in said] == ["'present beacon' was asked for where the log has 'nothing'"]


@pytest.mark.parametrize("spans", [(1.0, 1.0, 1.0), (2.5,), (1.99, 0.03)])
def test_the_world_ends_with_the_log(tmp_path: Path, spans: tuple[float, ...]) -> None:
    path = logged(tmp_path / "run.mcap")
    got: list[WorldSample] = []
    with played(path).open() as world, pytest.raises(WorldEnded) as ended:
        for for_s in spans:
            got.extend(world.samples(for_s))
    assert sum(isinstance(s, JointState) for s in got) == 100
    assert str(ended.value) == (
        f"backend.log={path} ends at 2.000 s, but samples until {sum(spans):.3f} s are needed. "
        "Replay the stages that it was made with, or shorten them."
    )


def test_a_span_that_was_cut_short_is_not_taken_for_whole(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt), create(tmp_path / "run.mcap") as log:
        log.write(Event(0, "span", "10.0"))
        for sample in Ticking().samples(2.0):
            log.write(sample)
        raise KeyboardInterrupt
    with played(tmp_path / "run.mcap.part").open() as world, pytest.raises(WorldEnded):
        list(world.samples(10.0))


def refusal(backend: Replay) -> str:
    with pytest.raises(BadInput) as refused, backend.open():
        pass
    return str(refused.value)


def test_a_log_of_another_sensor_or_dof(tmp_path: Path) -> None:
    path = logged(tmp_path / "run.mcap")
    for other in (Replay(log=str(path), sensor="pa", dof=1), Replay(log=str(path), sensor="ec", dof=5)):
        assert refusal(other) == (
            f"backend.log={path} was made with sensor=ec dof=1, but sensor={other.sensor} dof={other.dof} is set. Type sensor=ec dof=1."
        )


def test_no_log_and_half_a_log(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    assert refusal(played(path)) == f"{path} was given as a log, but there is no such file. {GIVE}"
    logged(path)
    path.write_bytes(path.read_bytes()[:-9])
    assert refusal(played(path)).startswith(f"{path} has no end: ")
    path.write_bytes(b"t_s,ppm\n")
    assert refusal(played(path)).startswith(f"{path} was given as a log, but it is not an MCAP file.")


def test_it_keeps_a_backends_promises(tmp_path: Path) -> None:
    check_backend(played(logged(tmp_path / "run.mcap")))
    check_backend(played(logged(tmp_path / "unmarked.mcap", marks=False)), for_s=0.73)


def test_a_source_that_no_world_has_is_refused_and_is_no_command(tmp_path: Path) -> None:
    with played(logged(tmp_path / "run.mcap")).open() as world:
        with pytest.raises(BadInput, match=r"present\('tea'\) was asked for, but a world has none, beacon, source"):
            world.present("tea")
        world.present("none")
        assert len(times(world, 1.0)) == 50 and world.differing == 0
