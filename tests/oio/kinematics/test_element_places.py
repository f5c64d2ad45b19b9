"""Places of a sensor's elements are in the frame of the nose, which is MuJoCo's of the site or the body that carries it."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from oio.core.errors import BadInput
from oio.kinematics.chain_from_model import NosePoint, load_chain

TURNED = """<mujoco><compiler angle="radian" autolimits="true"/><worldbody><body name="a" pos="0.1 0 0.2" quat="2 0 0 2">
  <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/><joint name="one" axis="0 2 0" range="-1 1"/>
  <body name="plate" pos="0 0.3 0" quat="1 1 0 0"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
    <site name="nose" pos="0.05 0.02 0.01" quat="1 0.2 0.5 -0.3"/></body></body></worldbody></mujoco>"""


@pytest.mark.parametrize("nose", [NosePoint("nose"), NosePoint(body="plate", offset_m=(0.01, 0.0, 0.1))])
def test_the_frame_of_the_nose_is_mujocos(tmp_path, nose):
    path = tmp_path / "arm.xml"
    path.write_text(TURNED)
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    chain = load_chain(path, nose)
    joint = chain.poses[0][:3, :3]
    frame = data.site("nose").xmat if nose.body is None else data.body("plate").xmat
    np.testing.assert_allclose(joint @ chain.nose_rotation, frame.reshape(3, 3), atol=1e-12)


@pytest.mark.parametrize("dof", [1, 3, 5])
def test_elements_are_where_the_simulated_site_has_them(built, dof):
    arm = replace(built("arm", f"dof={dof}"), element_places_m=((0.01, 0.0, 0.02), (0.0, -0.03, 0.0)), element_spacing_m=0.06)
    np.testing.assert_allclose(arm.element_offsets_m, [[0.01, 0.03, 0.02], [0.0, -0.06, 0.0]])
    with replace(built("backend", f"dof={dof}"), arm=arm).plant() as plant:
        q = plant._angles[plant._joints]
        simulated = plant._nose_m() + plant._sensor.apart_m @ plant._site.xmat.reshape(3, 3).T
    p, jacobian = arm.element_jacobians(np.array([q]), 2)
    np.testing.assert_allclose(p[:, 0] - arm.nose(q), simulated - plant._nose_m(), atol=1e-3)  # backlash turns the board a little
    for e in range(2):
        numeric = [(arm.element_jacobians(np.array([q + h]), 2)[0][e, 0] - p[e, 0]) / 1e-6 for h in 1e-6 * np.eye(dof)]
        np.testing.assert_allclose(jacobian[e, 0], np.transpose(numeric), atol=1e-5)


def test_one_place_is_the_nose_and_two_have_their_middle(built):
    arm = built("arm", "dof=5")
    q = np.array([arm.home, arm.home + 0.1])
    assert arm.place_of(2) == (0, 0) and arm.element_chains[0] is arm.chain
    np.testing.assert_array_equal(arm.board(q, 2), arm.nose(q))
    apart = replace(arm, element_spacing_m=0.06)
    assert apart.place_of(2) == (0, 1) and apart.place_of(1) == (0,) and apart.spacing_m == pytest.approx(0.06)
    np.testing.assert_allclose(apart.board(q, 2), arm.nose(q), atol=1e-12)


@pytest.mark.parametrize("key", ["arm.element_spacing_m=0.6", "arm.element_places_m=[[0,0,0]]", "arm.element_places_m=[[0,0,0],[0,0,9]]"])
def test_places_off_the_board_are_refused(built, key):
    with pytest.raises(Exception, match="element_"):
        built("arm", key)


def test_a_way_of_sampling_that_is_none_is_refused(built):
    with pytest.raises(Exception, match="in_turn or together") as told:
        built("backend", "backend.sampling=both")
    assert isinstance(told.value.__cause__ or told.value, BadInput) or "backend.sampling" in str(told.value)
