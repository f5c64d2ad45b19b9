"""The chain is MuJoCo's, or the file is refused: never silently another arm."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from oio.core.errors import BadInput
from oio.kinematics.forward import SerialChain, nose_and_jacobian
from oio.kinematics.model_loading import load_chain

WRITTEN = """<mujoco><compiler angle="radian" autolimits="true"/><worldbody><body name="a" pos="0.1 0 0.2" quat="2 0 0 2">
  <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/><joint name="one" axis="0 2 0" range="-1 1"/>
  <body name="carrier" pos="0 0.3 0"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
    <body name="b" pos="0 0 0.1"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
      <joint name="two" type="slide" axis="1 0 0" range="0 1"/>
      <body name="plate" quat="1 1 0 0"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/><site name="nose" pos="0.05 0.02 0.01"/></body>
    </body></body></body></worldbody></mujoco>"""


def written(tmp_path, text):
    path = tmp_path / "arm.xml"
    path.write_text(text)
    return path


def agrees(path, q):
    """Whether the chain puts the nose where MuJoCo does, and has its limits."""
    chain, model = load_chain(path), mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    data.qpos[:] = q
    mujoco.mj_kinematics(model, data)
    if len(chain.names) != model.njnt or not np.allclose(np.column_stack([chain.low, chain.high]), model.jnt_range):
        return False
    serial = SerialChain(chain.poses, chain.axes, chain.kinds, np.zeros(len(chain.names)), chain.nose_offset)
    p, _ = nose_and_jacobian(np.array([q]), serial)
    return np.allclose(p[0], data.site("nose").xpos, atol=1e-9)


def test_slides_jointless_bodies_and_lengths_of_axes_are_read(tmp_path):
    path = written(tmp_path, WRITTEN)
    assert load_chain(path).names == ("one", "two")
    for q in ([0.0, 0.0], [0.7, 0.3], [-0.9, 1.0]):
        assert agrees(path, q)


def test_what_is_not_xml_is_refused(tmp_path):
    with pytest.raises(BadInput, match="is not XML"):
        load_chain(written(tmp_path, "joints: 5"))


@pytest.mark.parametrize(
    "text", [WRITTEN.replace('"nose"', '"tip"'), "<mujoco/>", '<mujoco><worldbody><site name="nose"/></worldbody></mujoco>']
)
def test_a_file_without_a_moving_nose_is_refused(tmp_path, text):
    with pytest.raises(BadInput, match="has no site named 'nose' on a moving body"):
        load_chain(written(tmp_path, text))


def test_a_nose_on_bodies_without_joints_is_refused(tmp_path):
    with pytest.raises(BadInput, match="has no site named 'nose' on a moving body"):
        load_chain(written(tmp_path, '<mujoco><worldbody><body><site name="nose"/></body></worldbody></mujoco>'))


COMPILER, ONE, TWO = '<compiler angle="radian" autolimits="true"/>', '<joint name="one" axis="0 2 0"', 'axis="1 0 0" range="0 1"/>'
INERTIA = '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'


def default(joint):
    return f"{COMPILER}<default>{joint}<default class='other'><geom size='1'/></default></default>"


ELSEWHERE = {  # what is written, instead of what, and what is said
    "pos of a joint": ('name="one"', 'name="one" pos="0 0 0.1"', "pos=\"0 0 0.1\" at joint 'one'.*Move the body there"),
    "ref of a joint": ('name="one"', 'name="one" ref="0.2"', "ref=\"0.2\" at joint 'one'.*Leave ref out"),
    "ball": (f'{ONE} range="-1 1"/>', '<joint name="one" type="ball"/>', "type=\"ball\" at joint 'one'.*a hinge or a slide"),
    "euler": ('pos="0 0.3 0"', 'pos="0 0.3 0" euler="0.3 0 0"', "euler=\"0.3 0 0\" at body 'carrier'.*Write quat="),
    "axisangle": ('pos="0 0.3 0"', 'axisangle="1 0 0 0.3"', "axisangle=.*at body 'carrier'.*Write quat="),
    "xyaxes": ('pos="0 0.3 0"', 'xyaxes="0 1 0 -1 0 0"', "xyaxes=.*at body 'carrier'.*Write quat="),
    "zaxis": ('pos="0 0.3 0"', 'zaxis="1 0 0"', "zaxis=.*at body 'carrier'.*Write quat="),
    "degrees": (
        'angle="radian"',
        'angle="degree"',
        '<compiler angle="degree">.*range="-1 1" of hinge \'one\'.*Write <compiler angle="radian"/>',
    ),
    "degrees unsaid": ('angle="radian" ', "", "no <compiler angle=.*in degrees"),
    "no compiler": (COMPILER, "", "no <compiler angle=.*in degrees"),
    "degrees at last": (COMPILER, f'{COMPILER}<compiler angle="degree"/>', '<compiler angle="degree">'),
    "two joints in one body": (TWO, f'{TWO}<joint name="three" axis="0 0 1" range="-1 1"/>', "2 joints in body 'b'.*body of its own"),
    "joint in a frame": (
        f'{ONE} range="-1 1"/>',
        f'<frame pos="0 0 1">{ONE} range="-1 1"/></frame>',
        "in body 'a', but a joint is a <joint>",
    ),
    "default type": (COMPILER, default('<joint type="slide"/>'), 'type="slide" for joints in a <default>.*Write type= at one'),
    "default axis": (
        f"{COMPILER}|{ONE}",
        default("<joint axis='0 1 0'/>") + '|<joint name="one"',
        'axis="0 1 0".*<default>.*Write axis= at one',
    ),
    "default range": (
        f'{COMPILER}|{ONE} range="-1 1"',
        default("<joint range='0 1'/>") + f"|{ONE}",
        "range=.*<default>.*Write range= at one",
    ),
    "default pos": (COMPILER, default('<joint pos="0 0 1"/>'), "pos=.*<default>.*Write pos= at one, two"),
    "default of a class": (
        COMPILER,
        default('<default class="x"><joint type="slide"/></default>'),
        'type="slide" for joints in a <default>',
    ),
    "default of the site": (COMPILER, default('<site pos="0 0 1"/>'), "a place for sites in a <default>"),
    "fromto of the site": ('pos="0.05 0.02 0.01"', 'type="capsule" size="0.01" fromto="0 0 0 0 0 1"', "fromto= at the site 'nose'"),
}


@pytest.mark.parametrize("feature", ELSEWHERE)
def test_what_is_not_read_is_refused_with_what_to_write(tmp_path, feature):
    old, new, said = ELSEWHERE[feature]
    text = WRITTEN
    for a, b in zip(old.split("|"), new.split("|"), strict=True):
        assert a in text
        text = text.replace(a, b)
    path = written(tmp_path, text)
    mujoco.MjModel.from_xml_path(str(path))  # MuJoCo takes it
    with pytest.raises(BadInput, match=said):
        load_chain(path)


def test_an_include_is_refused(tmp_path):
    (tmp_path / "more.xml").write_text("<mujoco><option timestep='0.001'/></mujoco>")
    with pytest.raises(BadInput, match=r"has an <include>.*into the file itself"):
        load_chain(written(tmp_path, WRITTEN.replace(COMPILER, f'{COMPILER}<include file="more.xml"/>')))


HARMLESS = {
    "zero pos": ('name="one"', 'name="one" pos="0 0 0" ref="0"'),
    "default that every joint overrides": (COMPILER, default('<joint axis="0 1 0" range="0 9" damping="1"/>')),
    "joints off the chain": (
        '<body name="plate"', f'<body name="jaw" euler="1 0 0">{INERTIA}<joint pos="0 0 1"/><joint axis="0 1 0"/></body><body name="plate"'
    ),
}  # fmt: skip


@pytest.mark.parametrize("feature", ["zero pos", "default that every joint overrides"])
def test_what_changes_nothing_is_taken(tmp_path, feature):
    assert agrees(written(tmp_path, WRITTEN.replace(*HARMLESS[feature])), [0.7, 0.3])


def test_joints_off_the_chain_may_be_as_they_like(tmp_path):
    assert load_chain(written(tmp_path, WRITTEN.replace(*HARMLESS["joints off the chain"]))).names == ("one", "two")


def test_slides_need_no_unit_of_angles(tmp_path):
    text = WRITTEN.replace(COMPILER, "").replace(f'{ONE} range="-1 1"/>', '<joint name="one" type="slide" axis="0 1 0" range="-1 1"/>')
    assert agrees(written(tmp_path, text), [0.7, 0.3])


@pytest.mark.parametrize("name", ["so101", "gantry"])
def test_the_shipped_arms_are_read(name):
    path = Path(__file__).resolve().parents[3] / "hardware" / "arms" / f"{name}.xml"
    assert agrees(path, 0.5 * mujoco.MjModel.from_xml_path(str(path)).jnt_range[:, 1])
