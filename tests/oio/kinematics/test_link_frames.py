"""Frames of the links: chained, they end where forward kinematics has the nose."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oio.core.quaternions import product, quaternion, rotation
from oio.kinematics.chain_from_model import NosePoint, load_chain
from oio.kinematics.forward import SerialChain, nose_and_jacobian
from oio.kinematics.link_frames import LinkFrames, in_base


@pytest.mark.parametrize("words", [("dof=5",), ("dof=2",), ("arm=gantry", "dof=3")])
def test_the_chain_of_frames_ends_at_the_nose(built, words):
    arm, rng = built("arm", *words), np.random.default_rng(1)
    frames = LinkFrames(arm.chain)
    for q in rng.uniform(arm.low_rad, arm.high_rad, (50, arm.dof)):
        places, turns = frames.at(q)
        assert len(places) == len(turns) == len(arm.all_names) + 1
        np.testing.assert_allclose(in_base(places[None], turns[None])[0, -1], arm.nose(q), atol=1e-12)


@pytest.mark.parametrize(
    ("file", "nose"), [("six.xml", NosePoint("tip")), ("four.urdf", NosePoint(body="tool0", offset_m=(0.0, 0.0, 0.1)))]
)
def test_so_it_does_on_arms_of_others(foreign_models, file, nose):
    model, rng = load_chain(foreign_models / file, nose), np.random.default_rng(2)
    chain = SerialChain(model.poses, model.axes, model.kinds, np.zeros(len(model.low)), model.nose_offset)
    for q in rng.uniform(model.low, model.high, (20, len(model.low))):
        at, _ = nose_and_jacobian(q[None, :], chain, False)
        np.testing.assert_allclose(in_base(*(part[None] for part in LinkFrames(chain).at(q)))[0, -1], at[0], atol=1e-12)


def test_rails_end_where_the_joint_may_go(built):
    arm = built("arm", "arm=gantry", "dof=3")
    rails = LinkFrames(arm.chain).rails(arm.model.low, arm.model.high)
    assert [frame for frame, *_ in rails] == [0, 1, 2]
    np.testing.assert_allclose(rails[0][1:], [[0.0, 0.0, 0.0], [5.94, 0.0, 0.0]])
    assert LinkFrames(built("arm", "dof=5").chain).rails(np.zeros(5), np.ones(5)) == []


unit = st.lists(st.floats(-1.0, 1.0), min_size=4, max_size=4).filter(lambda q: np.linalg.norm(q) > 0.1)


@given(unit, unit)
def test_a_product_of_quaternions_is_that_of_their_rotations(a, b):
    a, b = np.array(a) / np.linalg.norm(a), np.array(b) / np.linalg.norm(b)
    np.testing.assert_allclose(rotation(product(a[None], b[None])[0]), rotation(a) @ rotation(b), atol=1e-12)
    np.testing.assert_allclose(rotation(quaternion(rotation(a))), rotation(a), atol=1e-12)
