"""Arms that are not ours: a six-joint MJCF in degrees with meshes, and a URDF, as worlds and from the command line."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from hardware.simulation.mujoco_model import compile_model, servo_of
from oio.core.errors import BadInput
from oio.core.folders import ROOT
from oio.core.records import JointState, Truth
from oio.log import read_attachment

pytestmark = pytest.mark.long

SIX = {
    "name": "six", "ladder": (1, 2, 3, 6), "dof": 6, "home_rad": (0.0, 0.3, 0.8, 0.0, 0.5, 0.0), "nose_site": "tip",
    "box_low_m": (-1.0, -1.0, -1.0), "box_high_m": (1.0, 1.0, 1.5), "homing": None,
}  # fmt: skip
FOUR = {
    "name": "four", "ladder": (1, 2, 3), "dof": 3, "home_rad": (0.0, 0.4, 0.1), "nose_body": "tool0", "nose_offset_m": (0.0, 0.0, 0.1),
    "box_low_m": (-1.0, -1.0, -1.0), "box_high_m": (1.0, 1.0, 1.5),
}  # fmt: skip
KINDS = {"six": ("six.xml", SIX), "four": ("four.urdf", FOUR)}


def near_home(arm):
    """A place that the nose reaches, as words of the command line and as a tuple."""
    return tuple(round(float(x), 3) for x in arm.nose(arm.home) + np.array([0.0, 0.0, 0.05]))


@pytest.fixture(params=KINDS)
def foreign(request, built, foreign_models):
    """An arm of somebody else's model, and the backend that simulates it."""
    file, changes = KINDS[request.param]
    arm = replace(built("arm"), mjcf=str(foreign_models / file), backlash_deg=0.0, encoder_drift_deg_s2=0.0, **changes)
    backend = built("backend", "sensor=ndir", "air=steady")
    places = {key: replace(getattr(backend, key), position=near_home(arm), approach_m=0.1) for key in ("beacon", "source")}
    return arm, replace(backend, arm=arm, **places)


def test_a_foreign_arm_goes_where_it_is_sent(foreign):
    """By servos that its file does not have."""
    arm, backend = foreign
    goal = arm.home + 0.1
    with backend.open() as world:
        took_s = world.move(goal, 1.0)
        samples = list(world.samples(took_s + 1.0))
    truth = [sample for sample in samples if isinstance(sample, Truth)][-1]
    joints = [sample for sample in samples if isinstance(sample, JointState)][-1]
    np.testing.assert_allclose(joints.q, goal, atol=5e-3)
    np.testing.assert_allclose(truth.nose_m, arm.nose(truth.q), atol=1e-9)
    np.testing.assert_allclose(truth.nose_m, arm.nose(goal), atol=2e-3)


def test_every_joint_has_a_servo_and_ours_keep_their_own(foreign, built):
    arm, _ = foreign
    model, _ = compile_model(arm)
    assert len({servo_of(model, name) for name in arm.all_names}) == len(arm.all_names)
    ours, _ = compile_model(built("arm"))
    assert ours.nu == 5 and np.allclose(ours.actuator_gainprm[:, 0], 998.22)


def test_a_mesh_that_is_not_there_stops_the_simulation_alone(foreign_models, built, tmp_path):
    lonely = tmp_path / "six.xml"
    lonely.write_bytes((foreign_models / "six.xml").read_bytes())
    arm = replace(built("arm"), mjcf=str(lonely), **SIX)
    assert arm.names[-1] == "j6"
    with pytest.raises(BadInput, match=r"six.xml cannot be simulated. MuJoCo says: .*link.obj"):
        compile_model(arm)


@pytest.mark.parametrize("kind", KINDS)
def test_the_command_takes_a_foreign_arm(kind, built, foreign_models, tmp_path):
    file, changes = KINDS[kind]
    place = near_home(replace(built("arm"), mjcf=str(foreign_models / file), **changes))
    keys = {f"arm.{key}": value for key, value in changes.items() if key != "dof"} | {"arm.mjcf": foreign_models / file}
    keys |= {"dof": changes["dof"], "beacon.position": place, "source.position": place, "beacon.approach_m": 0.1, "source.approach_m": 0.1}
    words = [f"{key}={typed(value)}" for key, value in keys.items()]
    words += ["stage=[warm_up,baseline]", "sensor=ndir", f"hydra.run.dir={tmp_path / 'run'}"]
    done = subprocess.run(
        [sys.executable, "-m", "oio.run", *words, "report=false"], cwd=ROOT, capture_output=True, text=True, timeout=120, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert read_attachment(tmp_path / "run" / "run.mcap", "arm.mjcf").startswith(b"<mujoco")


def typed(value):
    """A value as Hydra reads it."""
    return "null" if value is None else str(list(value)).replace(" ", "") if isinstance(value, tuple) else str(value)
