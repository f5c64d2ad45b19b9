"""A calibration file of LeRobot is a homing file; what often goes wrong with one is refused."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from oio.core.errors import BadInput
from oio.kinematics.homing_file import read_homing

SO101 = {
    "shoulder_pan": (746, 3249),
    "shoulder_lift": (822, 3097),
    "elbow_flex": (950, 3153),
    "wrist_flex": (967, 3128),
    "wrist_roll": (0, 4095),
}


def written(tmp_path, **changes):
    """A LeRobot file of an SO-101 with a gripper; `changes` replace entries."""
    motors = {
        name: {"id": i, "drive_mode": 0, "homing_offset": -1365, "range_min": low, "range_max": high}
        for i, (name, (low, high)) in enumerate(SO101.items(), 1)
    }
    motors["gripper"] = {"id": 6, "drive_mode": 0, "homing_offset": 1181, "range_min": 2032, "range_max": 3288}
    for name, entry in changes.items():
        motors[name] = {**motors.get(name, {}), **entry} if entry else motors.pop(name) and {}
    path = tmp_path / "arm.json"
    path.write_text(json.dumps({name: entry for name, entry in motors.items() if entry}))
    return str(path)


@pytest.fixture
def limits(built):
    arm = built("arm")
    return arm.model.low, arm.model.high


def test_zeros_are_in_the_middle_of_the_ranges(tmp_path, limits):
    homing = read_homing(written(tmp_path), *limits)
    middles = [round((low + high) / 2) for low, high in SO101.values()]
    assert homing.zero_counts == tuple(middles) and homing.sign == (1,) * 5
    swept = np.array([(high - low) * 360 / 4096 for low, high in SO101.values()])
    expected = np.abs(swept - np.degrees(limits[1] - limits[0]))[:4] / 2 / math.sqrt(3)
    assert homing.u_deg == pytest.approx([*expected, 5.0])
    degrees = np.degrees(homing.angles(np.array(middles) + 100, 4096))
    assert np.allclose(degrees, 100 * 360 / 4095, rtol=1e-3)  # as LeRobot says them


def test_an_arm_takes_it(built, tmp_path):
    arm = built("arm", f"arm.homing={written(tmp_path)}", "dof=3")
    assert arm.homed.zero_counts[0] == 1998 and np.all(arm.homing_u_deg > 0)


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"elbow_flex": {"homing_offset": 99999}}, "elbow_flex has the homing_offset 99999, but it must be a whole number of counts"),
        ({"elbow_flex": {"range_min": 3600, "range_max": 900}}, "elbow_flex has range_min 3600 and range_max 900, but they must be whole"),
        ({"elbow_flex": {"range_min": -20}}, "range_min -20"),
        ({"elbow_flex": {"range_max": 4096}}, "range_max 4096"),
        ({"elbow_flex": {"range_max": "3000"}}, "range_max 3000, but they must be whole counts"),
        ({"elbow_flex": {"range_min": 4, "range_max": 4090}}, "elbow_flex was swept over 359 degrees, but the model's joint has 194"),
        ({"elbow_flex": {"range_min": 2000, "range_max": 2400}}, "it was not turned to both ends"),
        ({"wrist_flex": None}, "has no servo with id 4"),
    ],
)
def test_what_often_goes_wrong_is_refused(tmp_path, limits, changes, says):
    with pytest.raises(BadInput) as refused:
        read_homing(written(tmp_path, **changes), *limits)
    assert says in str(refused.value)


def test_a_file_that_was_cut_is_no_reason_to_write_over_it(tmp_path, limits):
    path = Path(written(tmp_path))
    path.write_text(path.read_text()[:100])
    with pytest.raises(BadInput, match=r"cannot be read as JSON .* make one under another name"):
        read_homing(str(path), *limits)
