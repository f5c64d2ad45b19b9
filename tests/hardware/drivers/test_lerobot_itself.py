"""LeRobot's own SO-101 on our emulated Feetech bus: registry, calibration file, handshake, degrees. Skipped without LeRobot."""

import json
import time

import numpy as np
import pytest

from hardware.drivers.robots.lerobot_options import LerobotOptions
from hardware.drivers.robots.lerobot_robot import LerobotRobot
from oio.core.errors import BadInput
from oio.core.records import JointState
from oio.log import read_metadata

pytest.importorskip("lerobot", reason="LeRobot is not installed: pip install 'oio[lerobot]'")
pytestmark = pytest.mark.long

JOINTS = ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll")
HALF_COUNT = 0.5 * 2.0 * np.pi / 4096  # rad: LeRobot's middle of 0 to 4095 is 2047.5


def calibrate(folder, range_max):
    """What `lerobot-calibrate` leaves of an arm whose servos have never been calibrated, if range_max is 4095."""
    entry = {"drive_mode": 0, "homing_offset": 0, "range_min": 0, "range_max": range_max}
    text = json.dumps({name: {"id": i, **entry} for i, name in enumerate((*JOINTS, "gripper"), start=1)})
    (folder / "mine.json").write_text(text)


@pytest.fixture
def so101(emulators, tmp_path, monkeypatch):
    """so101(range_max=4095): the robot, whose calibration file says so."""
    port = emulators("nose=scd30", "arm=feetech", "gripper=true", "valve=none", "speed=1").folder / "ports" / "arm"
    folder = tmp_path / "robots" / "so_follower"
    folder.mkdir(parents=True)
    monkeypatch.setattr("lerobot.robots.robot.HF_LEROBOT_CALIBRATION", tmp_path)

    def make(range_max=4095):
        calibrate(folder, range_max)
        return LerobotRobot(LerobotOptions(type="so101_follower", id="mine", options=None), str(port), JOINTS, False)

    return make


def test_angles_are_read_and_commanded(so101):
    robot = so101()
    robot.connect()
    try:
        home = np.array(robot.read().q)
        assert np.allclose(home, [0.0, -1.0, 0.6, 0.9, 0.0], atol=2.1 * HALF_COUNT)
        goal = home + np.array([0.1, 0.0, 0.0, 0.0, -0.1])
        robot.write(goal)
        time.sleep(1.5)
        assert np.allclose(robot.read().q, goal, atol=0.01)
    finally:
        robot.close()


def test_another_calibration_than_that_of_the_servos_is_refused(so101):
    robot = so101(range_max=3000)
    with pytest.raises(BadInput, match="lerobot-calibrate"):
        robot.connect()
    robot.close()


def test_a_calibration_runs_on_it(emulators, tmp_path):
    folder = tmp_path / "robots" / "so_follower"
    folder.mkdir(parents=True)
    calibrate(folder, 4095)
    bench = emulators("nose=scd30", "arm=feetech", "gripper=true", "valve=none", "speed=1")
    run = bench.run(
        "backend.arm.driver=lerobot", "backend.arm.lerobot.type=so101_follower", "backend.arm.lerobot.id=mine",
        f"backend.arm.joint_names=[{','.join(JOINTS)}]", "stage=[warm_up,baseline,calibrate_bouts]", within_s=400,
        HF_LEROBOT_CALIBRATION=str(tmp_path),
    )  # fmt: skip
    assert run.code == 0, run.said
    q = np.array([s.q for s in run.samples() if isinstance(s, JointState)])
    assert (
        np.sum(np.ptp(q, axis=0) > 0.02) >= 3
        and "LeRobot so101_follower mine" in json.loads(read_metadata(run.log)["devices"])["backend.arm"]
    )
