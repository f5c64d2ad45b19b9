"""`python -m hardware.joints`: what an arm says is shown, and it is led nowhere."""

import sys
import threading
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hydra.errors import MissingConfigException

from hardware import joints
from oio.cli.hydra_errors import known_error
from oio.core.errors import BadInput, OioError

ROOT = Path(__file__).resolve().parents[2]
WORDS = ["arm=ur5e", "dof=6", "backend.arm.driver=python", "backend.arm.port=their_arm:arm"]


@pytest.fixture
def theirs(monkeypatch, built):
    home, closed = np.array(built("arm", "arm=ur5e", "dof=6").home_rad), []

    def write(positions):
        raise AssertionError("it was led")

    arm = SimpleNamespace(
        read=lambda: home, write=write, close=lambda: closed.append(True), describe=lambda: "UR5e [serial 7]", closed=closed
    )
    arm.effort = lambda: [0.25] * 6
    monkeypatch.setitem(sys.modules, "their_arm", SimpleNamespace(arm=arm))
    monkeypatch.setattr("hardware.joints.FOR_S", 0.2)
    return arm


def test_joints_and_nose_are_shown_and_nothing_is_written(theirs, capsys):
    joints.main(WORDS)
    told = capsys.readouterr().out
    assert "UR5e [serial 7]: " in told and "shoulder_lift" in told and "-77.35" in told and "25 %" in told and "-180 to 180" in told
    assert "The nose is at [0.34, " in told and "where it may stand" in told and theirs.closed == [True]


def test_an_arm_elsewhere_is_said_to_be_so(theirs, capsys):
    theirs.read = lambda: [0.0] * 6
    joints.main(WORDS)
    assert "where it may NOT stand" in capsys.readouterr().out


def test_an_arm_of_ones_own_is_found(theirs, capsys, tmp_path):
    (tmp_path / "arm").mkdir()
    (tmp_path / "arm" / "mine.yaml").write_text((ROOT / "conf" / "arm" / "ur5e.yaml").read_text(encoding="utf-8").replace("UR5e", "Mine"))
    joints.main(["--config-dir", str(tmp_path), *(word.replace("arm=ur5e", "arm=mine") for word in WORDS)])
    assert "where it may stand" in capsys.readouterr().out
    with pytest.raises(MissingConfigException) as ended:
        joints.main([f"--config-dir={tmp_path}", "arm=mien"])
    assert "gantry, mine, so101" in str(known_error(ended.value, ROOT / "conf"))


def test_what_is_wrong_is_said_and_the_arm_let_go(theirs):
    def refuses():
        raise ConnectionRefusedError("nobody at 10.0.0.7")

    theirs.read = refuses
    with pytest.raises(OioError, match=r"their_arm:arm does not answer: .*ConnectionRefusedError: nobody at 10\.0\.0\.7"):
        joints.main(WORDS)
    assert theirs.closed == [True]
    with pytest.raises(BadInput, match="it can be python, lerobot, ros2; of servos"):
        joints.main([*WORDS[:2], "backend.arm.driver=feetech", "backend.arm.port=/dev/null"])


def test_angles_in_degrees_are_noticed(theirs, capsys, built):
    degrees = [float(angle) for angle in np.degrees(built("arm", "arm=ur5e", "dof=6").home_rad)]
    theirs.read = lambda: degrees
    joints.main(WORDS)
    told = capsys.readouterr().out
    assert "where it may NOT stand" in told and "if those are degrees, give radians" in told


@pytest.mark.parametrize("method", ["read", "describe"])
def test_a_call_that_never_returns_ends_with_what_to_do(theirs, method):
    setattr(theirs, method, threading.Event().wait)
    with pytest.raises(OioError, match=r"their_arm:arm hangs: a call has not returned for 0\.5 s\. Look at what your object waits for"):
        joints.main([*WORDS, "backend.timeouts.connect_s=0.5"])
