"""Writing a log: the same calls give the same bytes, nothing is lost on the way, and what a viewer needs is there."""

import dataclasses
import hashlib
import itertools
import json
import math
import shutil
import subprocess
import sys
from enum import Enum
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from oio.core.errors import BadInput
from oio.core.records import SECOND_NS, Belief, Event, GasReading, GasSample, Innovation, JointState, Truth
from oio.log import BeliefScene, BelievedNose, Entry, Progress, RunLog, StageMark, read_attachment, read_metadata, read_samples
from oio.log.part_file import PartialLogFile
from oio.log.plain_json import to_json
from oio.log.scene import CHI2_95, scene

JOINTS = ("azimuth", "elevation")


def create(path: Path, **changed: Any) -> Any:
    given: dict[str, Any] = {"sensor": "ec", "joints": JOINTS, "metadata": {"seed": "7"}, "attachments": {"config.yaml": b"dof: 2\n"}}
    return RunLog.create(path, **{**given, **changed})


def fill(log: RunLog, for_s: int = 3) -> None:
    """A little of everything."""
    t_ns = 0
    with log.stage("warm_up", lambda: t_ns) as close:
        log.write(Event(0, "present", "none"))
        for i in range(1, 10 * for_s + 1):
            t_ns = i * SECOND_NS // 10
            log.write(JointState(t_ns, [0.1 * i, 0.2], [1.0, -0.0], [5e-324, 0.0]))
            log.write(Truth(t_ns, [0.1 * i, 0.2], [0.3, 0.0, 0.1], [math.nan] * 3, 5.0))
            log.write(GasSample(t_ns, i % 2, 1.0 / i))
            log.reading(GasReading(t_ns, i % 2, 1.0 / i, 0.1))
            log.progress(t_ns, "drift below 1 ppm/min", f"{1 / i:.3f} ppm/min")
        close({"drift": math.nan})
    log.estimate(Belief(t_ns, [1.0, 2.0], [[1.0, 0.5], [0.5, 2.0]]), ("x", "y"), ("m", "m"))
    log.innovation(Innovation(t_ns, [2.0], [[4.0]], gated=False))
    log.odometry(t_ns, np.array([0.1, 0.2, 0.3]), np.diag([1.0, 2.0, 3.0]))
    log.spheres(t_ns, np.zeros((1, 3)), np.array([0.2]), [(np.ones(3), np.eye(3))], "one sphere")


def decoded(path: Path, topic: str) -> list[tuple[Any, Any]]:
    with path.open("rb") as file:
        found = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()]).iter_decoded_messages(topics=[topic])
        return [(entry.message, entry.decoded_message) for entry in found]


@pytest.fixture
def finished(tmp_path: Path) -> Path:
    path = tmp_path / "run.mcap"
    with create(path) as log:
        fill(log)
    return path


def test_same_calls_same_bytes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    sums = set()
    clocks = itertools.count()
    for i in range(3):
        if i == 2:  # a computer so slow that a second passes at every look at its clock
            monkeypatch.setattr("oio.log.part_file.time", SimpleNamespace(monotonic=lambda: float(next(clocks))))
        with create(tmp_path / f"{i}.mcap") as log:
            fill(log)
            sum(1 for _ in log.samples())
        sums.add(hashlib.sha256((tmp_path / f"{i}.mcap").read_bytes()).hexdigest())
    assert len(sums) == 1


def test_every_topic_and_its_numbers(finished: Path) -> None:
    topics: dict[str, list[Any]] = {}
    with finished.open("rb") as file:
        for _, channel, message in make_reader(file).iter_messages(log_time_order=False):
            topics.setdefault(channel.topic, []).append(message)
    assert set(topics) == {
        *("/arm/joint_states", "/gas/ec/sample", "/gas/ec/reading", "/truth/state", "/truth/nose", "/events", "/log"),
        *("/estimate/state", "/estimate/odom", "/estimate/innovation", "/estimate/tf", "/belief/scene", "/truth/scene", "/stage/warm_up"),
    }
    for messages in topics.values():
        assert [m.sequence for m in messages] == list(range(len(messages)))
        assert all(m.log_time == m.publish_time <= 3 * SECOND_NS for m in messages)


def test_what_a_viewer_gets(finished: Path) -> None:
    _, joints = decoded(finished, "/arm/joint_states")[0]
    assert [(j.name, j.velocity) for j in joints.joints] == [("azimuth", 1.0), ("elevation", 0.0)]
    _, odometry = decoded(finished, "/estimate/odom")[0]
    assert (odometry.frame_id, odometry.body_frame_id) == ("base", "nose_believed")
    assert np.array_equal(np.array(odometry.pose_covariance).reshape(6, 6)[:3, :3], np.diag([1.0, 2.0, 3.0]))
    _, frame = decoded(finished, "/estimate/tf")[0]
    assert (frame.parent_frame_id, frame.child_frame_id, frame.translation.z) == ("base", "nose_believed", 0.3)
    _, line = decoded(finished, "/log")[0]
    assert (line.name, line.message, line.level) == ("present", "none", 2)
    _, nose = decoded(finished, "/truth/nose")[0]
    assert (nose.frame_id, nose.pose.position.x, nose.pose.orientation.w) == ("base", 0.3, 1.0)
    _, surprise = decoded(finished, "/estimate/innovation")[0]
    assert (surprise.nis, surprise.gated) == (1.0, False)
    _, state = decoded(finished, "/estimate/state")[0]
    assert (list(state.names), list(state.units), list(state.cov_upper)) == (["x", "y"], ["m", "m"], [1.0, 0.5, 2.0])


def test_stage_begins_ends_and_tells_its_watchers(tmp_path: Path) -> None:
    heard: list[Entry] = []
    with create(tmp_path / "run.mcap") as log:
        log.watchers.append(heard.append)
        fill(log)
        with pytest.raises(ZeroDivisionError), log.stage("map", lambda: 4 * SECOND_NS):
            _ = 1 / 0
    told = [entry for entry in heard if isinstance(entry, StageMark | Progress)]
    assert [(entry.stage, getattr(entry, "state", "progress"), entry.t_ns) for entry in told] == [
        ("warm_up", "begin", 0),
        ("warm_up", "progress", SECOND_NS // 10),
        ("warm_up", "progress", SECOND_NS // 10 + SECOND_NS),
        ("warm_up", "progress", SECOND_NS // 10 + 2 * SECOND_NS),
        ("warm_up", "end", 3 * SECOND_NS),
        ("map", "begin", 4 * SECOND_NS),
        ("map", "failed", 4 * SECOND_NS),
    ]
    assert told[1] == Progress(SECOND_NS // 10, "warm_up", "drift below 1 ppm/min", "1.000 ppm/min")
    assert told[-1] == StageMark(4 * SECOND_NS, "map", "failed", "division by zero")
    kinds = (JointState, GasSample, Truth, Event, GasReading, Innovation, BelievedNose, BeliefScene)
    assert {kind for kind in kinds if any(isinstance(entry, kind) for entry in heard)} == set(kinds)
    results = [(m.state, json.loads(m.json)) for _, m in decoded(tmp_path / "run.mcap", "/stage/map")]
    assert results == [("begin", None), ("failed", {"error": "ZeroDivisionError", "text": "division by zero"})]
    assert [json.loads(m.json) for _, m in decoded(tmp_path / "run.mcap", "/stage/warm_up")] == [None, {"drift": None}]


def test_progress_is_an_event_once_a_second(finished: Path) -> None:
    said = [m.text for _, m in decoded(finished, "/events") if m.kind == "progress"]
    assert len(said) == 3
    assert said[0] == "warm_up: drift below 1 ppm/min: 1.000 ppm/min"


def test_spans_do_not_fill_the_text_log(tmp_path: Path) -> None:
    with create(tmp_path / "run.mcap") as log:
        log.write(Event(0, "span", "1.5"))
    assert len(decoded(tmp_path / "run.mcap", "/events")) == 1
    assert decoded(tmp_path / "run.mcap", "/log") == []


class Colour(Enum):
    RED = "red"


@dataclasses.dataclass(frozen=True, slots=True)
class Inner:
    values: tuple[float, ...]
    colour: Colour


@dataclasses.dataclass(frozen=True)
class Outer:
    inner: Inner
    array: Any
    odd: object


def test_results_as_json() -> None:
    value = Outer(Inner((1.0, math.nan, math.inf), Colour.RED), np.array([[1.0, math.nan]]), {2: np.float64(0.5), "n": np.int64(3)})
    assert json.loads(to_json(value)) == {
        "inner": {"values": [1.0, None, "inf"], "colour": "red"},
        "array": [[1.0, None]],
        "odd": {"2": 0.5, "n": 3},
    }
    assert json.loads(to_json(object())) == "<object object>"  # no address, which no two runs share
    assert json.loads(to_json([True, None, "a", Outer, np.bool_(True)]))[-1] is True


def test_hypothesis_is_drawn_as_its_95_percent_ellipsoid() -> None:
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    cov = turn @ np.diag([1e-4, 4e-4, 9e-4]) @ turn.T
    mean = np.array([0.1, 0.2, 0.3])
    ball = scene(0, np.zeros((0, 3)), np.zeros(0), [(mean, cov)], "").entities[1].spheres[0]
    x, y, z, w = (getattr(ball.pose.orientation, axis) for axis in "xyzw")
    drawn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    half = np.array([ball.size.x, ball.size.y, ball.size.z]) / 2
    assert np.allclose(drawn @ np.diag(half**2) @ drawn.T, CHI2_95 * cov)


def test_what_is_not_finite_is_not_drawn() -> None:
    update = scene(0, np.zeros((2, 3)), np.array([0.1, math.inf]), [(np.zeros(3), np.full((3, 3), math.nan))], "text")
    shells, guesses, words = update.entities
    assert [len(shells.spheres), len(guesses.spheres)] == [1, 0]
    assert shells.spheres[0].size.x == 0.2
    assert words.texts[0].text == "text"


def test_samples_so_far_from_the_unfinished_file(tmp_path: Path) -> None:
    with create(tmp_path / "run.mcap") as log:
        fill(log, for_s=5)
        given = list(log.samples())
        assert [type(s) for s in given[:4]] == [Event, JointState, Truth, GasSample]
        assert len(given) == 1 + 3 * 50  # no progress among them
        some = list(log.samples(SECOND_NS, 2 * SECOND_NS))
        assert {s.t_ns for s in some} == {i * SECOND_NS // 10 for i in range(11, 21)}
        reading = log.samples()
        next(reading)
        log.write(GasSample(6 * SECOND_NS, 0, 1.0))
        assert sum(1 for _ in reading) == 3 * 50  # what is written after the call is not part of it
    assert sum(1 for _ in read_samples(tmp_path / "run.mcap")) == 2 + 3 * 50


def test_a_failed_run_is_readable_and_keeps_its_part_name(tmp_path: Path) -> None:
    with pytest.raises(RuntimeError), create(tmp_path / "run.mcap") as log:
        fill(log)
        log.attach("report.txt", b"half")
        raise RuntimeError
    assert not (tmp_path / "run.mcap").exists()
    part = tmp_path / "run.mcap.part"
    assert sum(1 for _ in read_samples(part)) == 91
    assert read_attachment(part, "report.txt") == b"half"


def test_metadata_says_what_the_log_is(finished: Path) -> None:
    assert read_metadata(finished) == {"seed": "7", "schema_version": "1", "sensor": "ec", "dof": "2", "joints": "azimuth elevation"}


@pytest.mark.parametrize("taken", ["run.mcap", "run.mcap.part"])
def test_a_log_is_never_overwritten(tmp_path: Path, taken: str) -> None:
    (tmp_path / taken).write_bytes(b"precious")
    with pytest.raises(BadInput) as refused, create(tmp_path / "run.mcap"):
        pass
    assert str(refused.value) == (
        f"{tmp_path / taken} is there already, and a log is never overwritten. Give another folder, or move that file away."
    )
    assert (tmp_path / taken).read_bytes() == b"precious"


def test_more_joints_than_names_are_refused(tmp_path: Path) -> None:
    with create(tmp_path / "run.mcap") as log, pytest.raises(ValueError, match="zip"):
        log.write(JointState(0, [0.0] * 3, [0.0] * 3, [0.0] * 3))


def test_a_name_for_every_entry_of_a_belief(tmp_path: Path) -> None:
    with create(tmp_path / "run.mcap") as log, pytest.raises(ValueError) as refused:
        log.estimate(Belief(0, [1.0], [[1.0]]), ("x", "y"), ("m",))
    assert str(refused.value) == "a belief of 1 entries has 2 names and 1 units"


def test_an_independent_reader_accepts_it(finished: Path) -> None:
    rerun = shutil.which("rerun", path=str(Path(sys.executable).parent))
    if rerun is None:
        pytest.skip("the rerun command is not installed")
    shown = subprocess.run([rerun, "mcap", "info", str(finished)], capture_output=True, text=True, timeout=60, check=True)
    assert "/arm/joint_states" in shown.stdout
    assert "oio.v1.GasSample" in shown.stdout


def test_no_chunk_is_closed_while_a_belief_waits_for_its_reading(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Closing takes 2 ms. Gas in whole seconds would meet it every time."""
    closed_at: list[str] = []
    now, close = [""], PartialLogFile._close_chunk
    monkeypatch.setattr(PartialLogFile, "_close_chunk", lambda part: (closed_at.append(now[0]), close(part)))
    with create(tmp_path / "run.mcap") as log:
        for i in range(1000):
            t_ns = i * SECOND_NS // 100
            now[0] = "joints"
            log.write(JointState(t_ns, [0.1, 0.2], [0.0, 0.0], [0.0, 0.0]))
            if i % 50 == 0:
                now[0] = "gas"
                log.write(GasSample(t_ns, 0, 1.0))
                log.reading(GasReading(t_ns, 0, 1.0, 0.1))
                now[0] = "belief"
                log.innovation(Innovation(t_ns, [2.0], [[4.0]], gated=False))
    assert "gas" not in closed_at and len(closed_at) >= 9
