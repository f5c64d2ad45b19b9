"""What a 3-D viewer needs of the arm: frames that chain, shapes in these frames, and all of it readable again."""

import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from mcap.reader import make_reader

from oio.core.quaternions import rotation
from oio.core.records import SECOND_NS, JointState, Truth
from oio.kinematics.link_frames import LinkFrames, in_base
from oio.log import ArmFrames, MemoryLog, RunLog, Setup, read_hypotheses
from oio.log.arm_scene import arm_frames, frame_names, setup, setup_scene, source_scene, transforms
from oio.runtime.arm_display import ArmDisplay, setup_of

BEACON = np.array([0.33, 0.1, 0.16])


@pytest.fixture(scope="module")
def arm(built):
    return built("arm", "dof=5")


def test_the_transforms_chain_from_the_base_to_where_the_nose_is(arm):
    for q in np.random.default_rng(4).uniform(arm.low_rad, arm.high_rad, (20, 5)):
        sent = FrameTransforms.FromString(transforms(ArmFrames(7, *LinkFrames(arm.chain).at(q))).SerializeToString()).transforms
        names = frame_names(5)
        assert [(f.parent_frame_id, f.child_frame_id) for f in sent] == list(pairwise(names))
        assert names[0] == "base" and names[-1] == "nose" and {f.timestamp.nanos for f in sent} == {7}
        assert any(abs(f.rotation.w) < 0.999 for f in sent)  # real rotations
        read = arm_frames(7, transforms(ArmFrames(7, *LinkFrames(arm.chain).at(q))).SerializeToString())
        np.testing.assert_allclose(in_base(read.places_m[None], read.turns[None])[0, -1], arm.nose(q), atol=3e-5)


def test_every_link_reaches_from_its_frame_to_the_next(arm):
    still = setup_of(arm, BEACON)
    drawn = {entity.id: entity for entity in setup_scene(0, still).entities}
    for name, step in zip(frame_names(5)[:-1], still.steps_m, strict=True):
        entity = drawn[f"link {name}"]
        assert entity.frame_id == name and entity.frame_locked
        for cylinder in entity.cylinders:
            p, q = cylinder.pose.position, cylinder.pose.orientation
            along = rotation(np.array([q.x, q.y, q.z, q.w])) @ [0.0, 0.0, 0.5 * cylinder.size.z]
            np.testing.assert_allclose(np.array([p.x, p.y, p.z]) + along, step, atol=1e-12)
    assert sum(len(entity.cylinders) for entity in drawn.values()) == 6 and drawn["beacon"].frame_id == drawn["box"].frame_id == "base"


@pytest.mark.parametrize(("words", "beacon"), [(("dof=5",), BEACON), (("arm=gantry", "dof=3"), None)])
def test_what_stands_still_is_read_as_it_was_drawn(built, words, beacon):
    still = setup_of(built("arm", *words), beacon)
    read = setup(setup_scene(0, still).SerializeToString())
    assert isinstance(read, Setup) and len(read.rails) == len(still.rails)
    np.testing.assert_allclose(read.steps_m, still.steps_m, atol=1e-12)
    np.testing.assert_allclose(read.box_m, still.box_m)
    for one, other in zip(read.rails, still.rails, strict=True):
        assert one[0] == other[0] and np.allclose(one[1:], other[1:])
    assert (read.beacon_m is None) if beacon is None else np.array_equal(read.beacon_m, beacon)
    assert setup(source_scene(0, BEACON).SerializeToString()) is None


def told(display_for_s, move, arm):
    log, heard = MemoryLog(), []
    log.watchers.append(lambda entry: heard.append(entry) if isinstance(entry, ArmFrames) else None)
    display = ArmDisplay(arm, log)
    for i in range(50 * display_for_s):
        display.follow(JointState(i * SECOND_NS // 50, arm.home + move * i, np.zeros(5), np.zeros(5)))
    return [entry.t_ns / SECOND_NS for entry in heard]


def test_frames_come_ten_times_a_second_while_the_arm_moves_and_once_while_it_stands(arm):
    assert told(3, 0.0, arm) == [0.0]
    moving = told(3, 1e-3, arm)
    assert len(moving) == 30 and np.allclose(np.diff(moving), 0.1)


def scenes(path):
    return [entry for entry in read_hypotheses(path)]


def test_the_true_source_is_drawn_when_it_is_another_and_the_belief_alone_is_read_as_one(tmp_path: Path, arm):
    with RunLog.create(tmp_path / "run.mcap", sensor="ec", joints=arm.names, metadata={}, attachments={}) as log:
        log.setup(setup_of(arm, BEACON))
        with log.stage("navigate", lambda: 0):
            for t, x in enumerate([math.nan, math.nan, 0.3, 0.3, 0.4]):
                log.write(Truth(t, arm.home, np.zeros(3), np.full(3, x), 0.0))
        log.spheres(9, np.zeros((0, 3)), np.zeros(0), [(BEACON, 1e-4 * np.eye(3))], "one")
    with (tmp_path / "run.mcap").open("rb") as file:
        drawn = [message.log_time for *_, message in make_reader(file).iter_messages(topics=["/truth/scene"])]
    assert drawn == [0, 2, 4]
    ((t_ns, ((mean, cov),)),) = scenes(tmp_path / "run.mcap")
    assert t_ns == 9 and np.allclose(mean, BEACON) and np.allclose(cov, 1e-4 * np.eye(3))
