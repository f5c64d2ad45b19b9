"""What a 3-D viewer of Foxglove's schemas needs of a log: frames that hang together, shapes with a size, entities that are replaced."""

import math
import os
from pathlib import Path

import numpy as np
import pytest
from google.protobuf.descriptor import FieldDescriptor
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from mcap_protobuf.writer import Writer

from oio.cli.build import build
from oio.cli.compose import compose
from oio.cli.execute import execute
from oio.core.records import SECOND_NS, GasSample, JointState, Truth
from oio.log import RunLog
from oio.log.arm_scene import Color, FrameTransform, FrameTransforms, Quaternion, SceneEntity, SceneUpdate, Vector3
from oio.log.scene import SpherePrimitive
from oio.runtime.arm_display import ArmDisplay, setup_of

ROOT, ENTITIES = "base", 20  # the frame from which all others hang; so many entities on a topic at most
UNIT = 1e-4  # a quaternion may be off from unit length by so much
SOON_NS = SECOND_NS // 10  # an entity may be drawn so long before the first transform of its frame: viewers take that one until then
SIZED = ("SpherePrimitive", "CylinderPrimitive", "CubePrimitive")
SHORT = (
    "sensor=ec", "dof=3", "stage.navigate.max_moves=20", "stage.map_beliefs.repeats=2", "stage.map_beliefs.budget_s=0",
    "stage.calibrate_bouts.moves_per_rung=2",
)  # fmt: skip
DATA = Path(os.environ.get("OIO_DATA", "data"))
RECORDING = ("backend=recording", "recording=airscout32", "sensor=pa", "stage=[warm_up,baseline]")


def run(out, *words):
    composed = compose(words, ())
    execute(build(composed.cfg, composed.choices, list(words)), out, quiet=True)
    return out / "run.mcap"


@pytest.fixture(scope="module")
def searched(tmp_path_factory):
    return run(tmp_path_factory.mktemp("foxglove") / "searched", *SHORT)


def messages(path):
    """(topic, time in the log [ns], message), in the order of time, by the schemas in the file alone."""
    with path.open("rb") as file:
        for entry in make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages():
            yield entry.channel.topic, entry.message.log_time, entry.decoded_message


def faults(path):
    found, told = set(), list(messages(path))
    parents, begins = frames(told, found)
    last, drawn = {}, {}
    for topic, at_ns, message in told:
        found |= {f"{topic}: goes back in time"} if at_ns < last.get(topic, 0) else set()
        found |= {f"{topic}: is stamped with another time"} if stamp_ns(message) not in (None, at_ns) else set()
        last[topic] = at_ns
        for part in parts(message):
            found |= {f"{topic}: {fault}" for fault in faults_of(part)}
            if frame := getattr(part, "frame_id", ""):
                found |= {f"{topic}: {frame} hangs from {origin(frame, parents)}"} if origin(frame, parents) != ROOT else set()
                found |= {f"{topic}: {frame} comes later"} if begins.get(frame, 0) > at_ns + SOON_NS else set()
            if part.DESCRIPTOR.name == "SceneEntity":
                drawn.setdefault(topic, set()).add(part.id)
    return found | {f"{topic}: entities pile up" for topic, ids in drawn.items() if len(ids) > ENTITIES}


def frames(told, found):
    """Parent and first time [ns] of every frame."""
    parents, begins = {}, {}
    for topic, at_ns, message in told:
        for part in parts(message):
            if part.DESCRIPTOR.name == "FrameTransform":
                begins.setdefault(part.child_frame_id, at_ns)
                if parents.setdefault(part.child_frame_id, part.parent_frame_id) != part.parent_frame_id:
                    found.add(f"{topic}: {part.child_frame_id} has two parents")
    return parents, begins


def origin(frame, parents):
    seen = set()
    while frame in parents and frame not in seen:
        seen.add(frame)
        frame = parents[frame]
    return frame


def stamp_ns(message):
    at = getattr(message, "timestamp", None) or getattr(message, "stamp", None)
    return None if at is None else at.seconds * SECOND_NS + at.nanos


def parts(message):
    """A message, and all messages within it."""
    yield message
    for field, value in message.ListFields():
        if field.type == FieldDescriptor.TYPE_MESSAGE:
            for part in value if field.is_repeated else [value]:
                yield from parts(part)


def faults_of(part):
    name = part.DESCRIPTOR.name
    if name in ("Vector3", "Point3", "Quaternion") and not all(map(math.isfinite, (part.x, part.y, part.z))):
        yield f"a {name} is not finite"
    if name == "Quaternion" and not abs(math.hypot(part.x, part.y, part.z, part.w) - 1.0) < UNIT:
        yield "a quaternion is not of unit length"
    if name == "Color" and not all(0.0 <= value <= 1.0 for value in (part.r, part.g, part.b, part.a)):
        yield "a colour is not between 0 and 1"
    if name in SIZED and not min(part.size.x, part.size.y, part.size.z) > 0.0:
        yield f"a {name} has no size"
    if name == "SceneEntity" and (not part.id or part.lifetime.seconds or part.lifetime.nanos):
        yield "an entity has no name or a lifetime, so that the next does not replace it"


def test_the_log_of_a_search_can_be_drawn(searched):
    assert faults(searched) == set()


def test_so_can_that_of_a_bench_which_knows_its_source_alone(built, tmp_path):
    """Its stamps are the time of day; its frames come late, with the first word of the arm."""
    arm, unknown = built("arm", "dof=3"), np.full(3, np.nan)
    started, place = {"started": "2026-03-01T12:00:00+01:00"}, np.array([0.3, 0.0, 0.1])
    with RunLog.create(tmp_path / "bench.mcap", sensor="ec", joints=arm.names, metadata=started, attachments={}) as log:
        log.setup(setup_of(arm, place))
        display = ArmDisplay(arm, log)
        display.follow(JointState(SECOND_NS // 20, arm.home, np.zeros(3), np.zeros(3)))
        log.write(Truth(SECOND_NS, np.full(3, np.nan), unknown, place, math.nan))
        log.write(GasSample(SECOND_NS, 0, 1.0))
        log.spheres(SECOND_NS, place[None], np.ones(1), [(place, np.eye(3)), (unknown, np.eye(3))], "one")
        log.odometry(SECOND_NS, place, np.eye(3))
    assert faults(tmp_path / "bench.mcap") == set()


def test_so_can_that_of_a_kept_calibration(searched, tmp_path):
    kept = f"calibration={searched.parent / 'calibration.yaml'}", "stage=[navigate,evaluate]"
    assert faults(run(tmp_path / "kept", *SHORT[:3], *kept)) == set()


@pytest.mark.skipif(not (DATA / "airscout32").is_dir(), reason="no recordings here: OIO_DATA names no folder that has them")
def test_so_can_that_of_a_recording(tmp_path):
    assert faults(run(tmp_path / "recorded", *RECORDING)) == set()


@pytest.mark.slow
@pytest.mark.parametrize("words", [("dof=1",), ("dof=2",), ("arm=gantry",), ("dof=5", "sensor=mox_mics"), ("dof=5", "world=three_sources")])
def test_so_can_those_of_other_arms_sensors_and_worlds(words, tmp_path):
    changed = {word.partition("=")[0]: word for word in (*SHORT, *words)}
    assert faults(run(tmp_path / "run", *changed.values())) == set()


def test_what_cannot_be_drawn_is_found(tmp_path):
    def frame(parent, child, **turn):
        return FrameTransform(parent_frame_id=parent, child_frame_id=child, translation=Vector3(x=math.nan), rotation=Quaternion(**turn))

    ball = SpherePrimitive(size=Vector3(x=1.0, y=0.0, z=1.0), color=Color(r=2.0))
    entities = [SceneEntity(id=f"{i}", frame_id="lost") for i in range(30)]
    with (tmp_path / "odd.mcap").open("wb") as file, Writer(file) as log:
        log.write_message("/scene", SceneUpdate(entities=[SceneEntity(frame_id="late", spheres=[ball]), *entities]), 5, 5)
        log.write_message(
            "/tf", FrameTransforms(transforms=[frame("base", "late", w=0.5), frame("x", "late", w=1.0)]), SECOND_NS, SECOND_NS
        )
        log.write_message("/estimate/tf", frame("base", "y", w=1.0), SECOND_NS, SECOND_NS)
    assert faults(tmp_path / "odd.mcap") == {
        "/scene: a SpherePrimitive has no size", "/scene: a colour is not between 0 and 1", "/scene: entities pile up",
        "/scene: an entity has no name or a lifetime, so that the next does not replace it", "/scene: late comes later",
        "/scene: lost hangs from lost", "/tf: a Vector3 is not finite", "/tf: a quaternion is not of unit length",
        "/tf: late has two parents", "/estimate/tf: a Vector3 is not finite", "/estimate/tf: is stamped with another time",
    }  # fmt: skip
