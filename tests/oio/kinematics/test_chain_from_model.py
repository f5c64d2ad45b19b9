"""The kinematic chain is MuJoCo's, whatever way the model file is written; what cannot be a chain is refused."""

from pathlib import Path

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from oio.core.errors import BadInput
from oio.core.folders import ROOT
from oio.kinematics.chain_from_model import NosePoint, load_chain
from oio.kinematics.forward import SerialChain, nose_and_jacobian
from oio.kinematics.model_loading import kinematics_mjcf

WRITTEN = """<mujoco><compiler angle="radian" autolimits="true"/><worldbody><body name="a" pos="0.1 0 0.2" quat="2 0 0 2">
  <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/><joint name="one" axis="0 2 0" range="-1 1"/>
  <body name="carrier" pos="0 0.3 0"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
    <body name="b" pos="0 0 0.1"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
      <joint name="two" type="slide" axis="1 0 0" range="0 1"/>
      <body name="plate" quat="1 1 0 0"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/><site name="nose" pos="0.05 0.02 0.01"/></body>
    </body></body></body></worldbody></mujoco>"""
COMPILER = '<compiler angle="radian" autolimits="true"/>'
ONE, RANGE = '<joint name="one" axis="0 2 0"', ' range="-1 1"/>'
INERTIA = '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'


def written(tmp_path, text, name="arm.xml"):
    path = tmp_path / name
    path.write_text(text)
    return path


def by_mujoco(model, names, q, nose):
    """Nose (3,) m and Jacobian (3, joints) of MuJoCo with the joints of these names at q."""
    data = mujoco.MjData(model)
    for name, value in zip(names, q, strict=True):
        data.joint(name).qpos = value
    mujoco.mj_forward(model, data)
    jacobian = np.zeros((3, model.nv))
    if nose.body is None:
        p = np.array(data.site(nose.site).xpos)
        mujoco.mj_jacSite(model, data, jacobian, None, model.site(nose.site).id)
    else:
        body = data.body(nose.body)
        p = body.xpos + body.xmat.reshape(3, 3) @ nose.offset_m
        mujoco.mj_jac(model, data, jacobian, None, p, model.body(nose.body).id)
    return p, jacobian[:, [model.joint(name).dofadr[0] for name in names]]


def agrees(path, q, nose=NosePoint(), model=None):  # noqa: B008 - frozen
    """Whether the chain puts the nose where MuJoCo does, with its Jacobian."""
    chain, model = load_chain(path, nose), model or mujoco.MjModel.from_xml_path(str(path))
    serial = SerialChain(chain.poses, chain.axes, chain.kinds, np.zeros(len(chain.names)), chain.nose_offset)
    p, jacobian = nose_and_jacobian(np.array([q], dtype=float), serial)
    p_true, jacobian_true = by_mujoco(model, chain.names, q, nose)
    return np.allclose(p[0], p_true, atol=1e-9) and np.allclose(jacobian[0], jacobian_true, atol=1e-9)


def test_slides_jointless_bodies_and_lengths_of_axes_are_read(tmp_path):
    path = written(tmp_path, WRITTEN)
    chain = load_chain(path)
    assert chain.names == ("one", "two")
    np.testing.assert_array_equal([chain.low, chain.high], [[-1.0, 0.0], [1.0, 1.0]])
    assert all(agrees(path, q) for q in ([0.0, 0.0], [0.7, 0.3], [-0.9, 1.0]))


DEFAULT = f'{COMPILER}<default><joint axis="0 1 0"/><site pos="0 0 1"/></default>'
WAYS = {  # what is written, instead of what
    "pos of a joint": ('name="one"', 'name="one" pos="0 0.1 0.1"'),
    "ref of a hinge": ('name="one"', 'name="one" ref="0.2"'),
    "ref of a slide": ('name="two"', 'name="two" ref="0.2"'),
    "euler": ('pos="0 0.3 0"', 'pos="0 0.3 0" euler="0.3 0 0"'),
    "axisangle": ('pos="0 0.3 0"', 'axisangle="1 0 0 0.3"'),
    "xyaxes": ('pos="0 0.3 0"', 'xyaxes="0 1 0 -1 0 0"'),
    "zaxis": ('pos="0 0.3 0"', 'zaxis="1 0 0"'),
    "degrees": ('angle="radian"', 'angle="degree"'),
    "degrees unsaid": ('angle="radian" ', ""),
    "a joint in a frame": (ONE + RANGE, f'<frame pos="0 0 1" euler="0.2 0 0">{ONE}{RANGE}</frame>'),
    "default axis": (f"{COMPILER}|{ONE}", f'{DEFAULT}|<joint name="one"'),
    "default place of the site": (f'{COMPILER}|<site name="nose" pos="0.05 0.02 0.01"/>', f'{DEFAULT}|<site name="nose"/>'),
    "fromto of the site": ('pos="0.05 0.02 0.01"', 'type="capsule" size="0.01" fromto="0 0 0 0 0 1"'),
    "joints off the chain": ('<body name="plate"', f'<body name="jaw">{INERTIA}<joint axis="0 1 0"/></body><body name="plate"'),
}


@pytest.mark.parametrize("feature", WAYS)
def test_what_mujoco_compiles_is_read_as_it_is_meant(tmp_path, feature):
    old, new = WAYS[feature]
    text = WRITTEN
    for a, b in zip(old.split("|"), new.split("|"), strict=True):
        assert a in text
        text = text.replace(a, b)
    path = written(tmp_path, text)
    assert load_chain(path).names == ("one", "two")
    assert all(agrees(path, q) for q in ([0.0, 0.0], [0.7, 0.3]))


def test_two_joints_in_one_body_are_two_joints(tmp_path):
    text = WRITTEN.replace('range="0 1"/>', 'range="0 1"/><joint name="three" axis="0 1 1" pos="0.1 0 0" range="-1 1"/>')
    path = written(tmp_path, text)
    assert load_chain(path).names == ("one", "two", "three") and agrees(path, [0.4, 0.2, -0.8])


def test_includes_are_followed(tmp_path):
    (tmp_path / "more.xml").write_text("<mujoco><default><joint axis='0 1 0'/></default></mujoco>")
    text = WRITTEN.replace(COMPILER, f'{COMPILER}<include file="more.xml"/>').replace(ONE, '<joint name="one"')
    assert agrees(written(tmp_path, text), [0.7, 0.3])


def test_six_joints_in_degrees_with_default_classes_and_meshes(foreign_models):
    path = foreign_models / "six.xml"
    chain, nose = load_chain(path, NosePoint(site="tip")), NosePoint(site="tip")
    assert chain.names == ("j1", "j2", "j3", "j4", "j5", "j6")
    np.testing.assert_allclose(np.degrees(chain.high), [170, 100, 170, 90, 170, 90])
    rng = np.random.default_rng(0)
    assert all(agrees(path, q, nose) for q in rng.uniform(chain.low, chain.high, (20, 6)))
    (foreign_models / "parts" / "link.obj").unlink()  # kinematics need no geometry
    assert load_chain(path, nose).names == chain.names


def test_a_urdf_with_the_nose_on_a_fixed_link(foreign_models):
    path, nose = foreign_models / "four.urdf", NosePoint(body="tool0", offset_m=(0.0, 0.01, 0.1))
    chain = load_chain(path, nose)
    assert chain.names == ("pan", "tilt", "reach")
    np.testing.assert_allclose([chain.low, chain.high], [[-2.0, -np.pi, 0.0], [2.0, np.pi, 0.3]])
    spec = mujoco.MjSpec.from_file(str(path))
    spec.compiler.fusestatic = False
    for geom in list(spec.geoms):
        spec.delete(geom)
    for mesh in list(spec.meshes):
        spec.delete(mesh)
    rng, model = np.random.default_rng(0), spec.compile()
    assert all(agrees(path, q, nose, model) for q in rng.uniform(chain.low, chain.high, (20, 3)))


numbers = st.floats(-1.0, 1.0, allow_nan=False).map(lambda x: round(x, 3))
triples = st.tuples(numbers, numbers, numbers)
directions = triples.filter(lambda v: sum(x * x for x in v) > 0.01)
bodies = st.lists(
    st.tuples(triples, triples, st.lists(st.tuples(st.booleans(), directions, triples, numbers), max_size=2)), min_size=1, max_size=5
).filter(lambda made: any(joints for _, _, joints in made))


def text_of(values):
    return " ".join(f"{value:g}" for value in values)


@settings(deadline=None, max_examples=60)
@given(bodies, triples, st.integers(0, 2**32 - 1))
def test_any_chain_is_mujocos(tmp_path_factory, made, tip, seed):
    """Random trees of bodies with hinges and slides, off their origins, with `ref`, in degrees."""
    inner, count = f'<site name="nose" pos="{text_of(tip)}"/>', 0
    for pos, euler, joints in reversed(made):
        written_joints = ""
        for slides, axis, at, ref in joints:
            kind, limits = ("slide", "-1 1") if slides else ("hinge", "-170 170")
            written_joints += (
                f'<joint name="j{count}" type="{kind}" axis="{text_of(axis)}" pos="{text_of(at)}" ref="{ref:g}" range="{limits}" '
                'armature="1"/>'
            )
            count += 1
        inner = f'<body pos="{text_of(pos)}" euler="{text_of(np.multiply(90, euler))}">{INERTIA}{written_joints}{inner}</body>'
    path = written(tmp_path_factory.mktemp("chain"), f"<mujoco><worldbody>{inner}</worldbody></mujoco>")
    chain = load_chain(path)
    assert sorted(chain.names) == sorted(f"j{i}" for i in range(count))
    assert agrees(path, np.random.default_rng(seed).uniform(chain.low, chain.high))


@pytest.mark.parametrize(
    "text", ["joints: 5", "<mujoco><worldbody><body/>", "<mujoco><worldbody><body><joint/></body></worldbody></mujoco>x"]
)
def test_what_mujoco_does_not_compile_is_refused_with_its_words(tmp_path, text):
    with pytest.raises(BadInput, match=r"is no model that MuJoCo compiles: .* Give an MJCF with a site"):
        load_chain(written(tmp_path, text))


@pytest.mark.parametrize("text", [WRITTEN.replace('"nose"', '"tip"'), "<mujoco/>"])
def test_a_file_without_the_site_is_refused_with_those_it_has(tmp_path, text):
    there = "tip" if "tip" in text else "none"
    with pytest.raises(BadInput, match=rf"has no site named 'nose' \(sites: {there}\).*arm.nose_site=NAME.*arm.nose_body=NAME"):
        load_chain(written(tmp_path, text))


def test_an_unknown_body_is_refused_with_those_that_are_there(tmp_path):
    with pytest.raises(BadInput, match=r"arm.nose_body=hand was given, but the bodies of .* are a, carrier, b, plate"):
        load_chain(written(tmp_path, WRITTEN), NosePoint(body="hand"))


@pytest.mark.parametrize(
    "text",
    [
        '<mujoco><worldbody><body><site name="nose"/></body></worldbody></mujoco>',
        '<mujoco><worldbody><site name="nose"/></worldbody></mujoco>',
    ],
)
def test_a_nose_that_no_joint_moves_is_refused(tmp_path, text):
    with pytest.raises(BadInput, match="has its nose on a body that no joint moves"):
        load_chain(written(tmp_path, text))


@pytest.mark.parametrize(("joint", "kind"), [('<joint name="one" type="ball"/>', "ball"), ('<freejoint name="one"/>', "free")])
def test_ball_and_free_joints_are_refused(tmp_path, joint, kind):
    with pytest.raises(BadInput, match=f"by the {kind} joint 'one', but a joint can be a hinge or a slide"):
        load_chain(written(tmp_path, WRITTEN.replace(ONE + RANGE, joint)))


def test_joints_without_names_get_some(tmp_path):
    text = WRITTEN.replace('name="one"', "").replace('name="two"', 'name="joint0"')
    assert load_chain(written(tmp_path, text)).names == ("joint1", "joint0")  # a name of the file is nobody else's


@pytest.mark.parametrize("active", ["true", "false"])
def test_joints_that_follow_each_other_are_refused(tmp_path, active):
    text = WRITTEN.replace("</mujoco>", f'<equality><joint joint1="one" joint2="two" active="{active}"/></equality></mujoco>')
    if active == "false":
        load_chain(written(tmp_path, text))
        return
    with pytest.raises(BadInput, match=r"couples its joints 'one' and 'two' .* but 'one' moves the nose"):
        load_chain(written(tmp_path, text))


def test_a_slide_without_limits_is_refused(tmp_path):
    with pytest.raises(BadInput, match="sliding joint 'two' without limits"):
        load_chain(written(tmp_path, WRITTEN.replace(' range="0 1"/>', "/>")))


@pytest.mark.parametrize("name", ["so101", "gantry"])
def test_the_shipped_arms_are_read(name):
    path = Path(ROOT / "hardware" / "arms" / f"{name}.xml")
    assert agrees(path, 0.5 * mujoco.MjModel.from_xml_path(str(path)).jnt_range[:, 1])


@pytest.mark.parametrize("kind", ["six", "four", "so101"])
def test_a_log_keeps_a_model_that_reads_the_same_chain(tmp_path, foreign_models, kind):
    """Without the files that it includes; a file that stands alone is kept to the byte."""
    if kind == "six":
        path, nose = foreign_models / "six.xml", NosePoint(site="tip")
    elif kind == "four":
        path, nose = foreign_models / "four.urdf", NosePoint(body="tool0", offset_m=(0.0, 0.01, 0.1))
    else:
        path, nose = ROOT / "hardware" / "arms" / "so101.xml", NosePoint()
    (tmp_path / "log").mkdir()
    kept = tmp_path / "log" / "arm.mjcf"
    kept.write_bytes(kinematics_mjcf(path))
    assert (kept.read_bytes() == path.read_bytes()) == (kind == "so101")
    before, after = load_chain(path, nose), load_chain(kept, nose)
    assert before.names == after.names
    for key in ("poses", "axes", "kinds", "low", "high", "nose_offset"):
        np.testing.assert_allclose(getattr(after, key), getattr(before, key), atol=5e-6)  # six digits in XML
