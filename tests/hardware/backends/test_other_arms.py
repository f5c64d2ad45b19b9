"""A bench whose arm a Python object commands, as a person would run it: an emulated UR5e behind a socket, and the nose that it carries."""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hydra.errors import InstantiationException
from hydra.utils import instantiate

from hardware.emulators import options
from hardware.emulators.emulated_bench import emulate_bench
from oio.core.errors import BadInput
from oio.core.records import JointState
from oio.log import read_metadata
from oio.testing import check_live_backend
from tests.hardware.conftest import ENV, Run

ROOT = Path(__file__).resolve().parents[3]
KEYS = ROOT / "conf" / "emulate.yaml"
SERVED = Path(__file__).with_name("served_arm.py")
SHORT = ("stage=[warm_up,baseline,calibrate_bouts]", "stage.calibrate_bouts.moves_per_rung=2")
USER = """
import json, os, socket, time

class Arm:
    simulated = True

    def __init__(self):
        link = socket.socket(socket.AF_UNIX)
        link.connect(os.environ["ARM_SOCKET"])
        self._file, self._began_s, self._last = link.makefile("rw"), time.monotonic(), None

    def _ask(self, what):
        self._file.write(json.dumps(what) + "\\n")
        self._file.flush()
        return json.loads(self._file.readline())

    def read(self):
        said = self._ask("read")
        self._load, q = said["load"], said["q"]
        fault = os.environ.get("FAULT") if time.monotonic() - self._began_s > float(os.environ.get("AFTER_S", 0)) else None
        if fault == "raises":
            raise ValueError("protective stop, joint 2")
        if fault == "hangs":
            time.sleep(60.0)
        if fault == "jumps":
            return [q[0] + 0.7, *q[1:]]
        self._last = self._last if fault == "stale" else q
        return self._last

    def effort(self):
        return self._load

    def write(self, positions):
        self._ask(positions.tolist())

    def describe(self):
        return "UR5e behind a socket"

    def close(self):
        self._file.close()
"""


@pytest.fixture
def ur5e(tmp_path):
    """ur5e(*words, **environment) is a run against a served UR5e; its object is user_arm:Arm."""
    (tmp_path / "user_arm.py").write_text(USER, encoding="utf-8")
    words = ["nose=scd30", "valve=line", "speed=3", "arm=ur5e", "dof=6", "sensor=ndir"]
    process = subprocess.Popen(
        [sys.executable, SERVED, tmp_path, *words], cwd=ROOT, env=ENV, text=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    assert process.stdin and process.stdout
    command = [sys.executable, *shlex.split(process.stdout.readline())[1:], "report=false"]

    def run(*words, within_s=240.0, **environment):
        out = tmp_path / "run"
        arm = ["backend.arm.driver=python", "backend.arm.port=user_arm:Arm"]
        env = {**ENV, "PYTHONPATH": f"{ROOT}{os.pathsep}{tmp_path}", "ARM_SOCKET": str(tmp_path / "arm"), **environment}
        done = subprocess.run(
            [*command, *arm, *words, f"hydra.run.dir={out}"],
            cwd=ROOT,
            env=env,
            capture_output=True,
            text=True,
            timeout=within_s,
            check=False,
        )
        assert "Traceback" not in done.stderr, done.stderr
        return Run(done.returncode, done.stdout + done.stderr, out)

    yield run
    process.stdin.close()
    assert process.wait(20) == 0
    process.stdout.close()


@pytest.mark.slow
def test_six_joints_climb_toward_the_beacon_by_an_object_of_the_users(ur5e):
    run = ur5e(*SHORT)
    assert run.code == 0, run.said
    assert "UR5e behind a socket" in read_metadata(run.log)["devices"]
    q = np.array([s.q for s in run.samples() if isinstance(s, JointState)])
    assert q.shape[1] == 6 and np.sum(np.ptp(q, axis=0) > 0.02) >= 3 and run.all_accounted()
    hz = float(re.search(r"joints ([\d.]+) Hz", run.account())[1])
    print(f"joints at {hz:.0f} Hz")  # of the bench, at three times its speed
    assert hz > 30.0 and "load at most" in run.account()


class EmulatorsArm:
    """An object that leads the emulator's own arm, in the same process."""

    simulated = True

    def __init__(self, joints):
        self.joints = joints

    def read(self):
        return self.joints.angles()

    def write(self, positions):
        for joint, goal in enumerate(positions):
            self.joints.steer(joint, float(goal))

    def close(self):
        pass


def test_an_arm_of_an_object_is_a_live_backend_and_needs_no_homing(built, tmp_path, monkeypatch):
    """Its nose smells where the object's arm is: both are of one simulation."""
    bench_words = ("air=steady", "arm=ur5e", "dof=6", "sensor=ndir")
    chosen, _ = options.read(["nose=scd30", "arm=none", "speed=2", f"out={tmp_path}"], KEYS)
    with emulate_bench(chosen, built("backend", *bench_words)) as bench, bench.loop.running():
        monkeypatch.setitem(sys.modules, "emulators_arm", SimpleNamespace(arm=EmulatorsArm(bench.loop.realtime)))
        words = [f"backend.{key}.port={port}" for key, port in bench.ports.items()]
        words += ["backend.nose.driver=scd30", "backend.valve.driver=line", "backend.speed=2", "safety.heartbeat_timeout_s=10"]
        words += ["backend.arm.driver=python", "backend.arm.port=emulators_arm:arm", "backend.timeouts.connect_s=20"]
        check_live_backend(built("backend", "backend=serial", *bench_words, *words), for_s=3.0)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["backend.arm.driver=python"], r"driver=python has no port\. Type backend\.arm\.port=my_arm:Arm, or backend\.arm\.driver=none"),
        (["backend.arm.driver=python", "backend.arm.port=sys:maxsize", "backend.speed=4"], "is real, and so is its time"),
        (["backend.arm.driver=ros2", "backend.arm.port=/a", "backend.speed=4"], "is real, and so is its time"),
        (["backend.arm.driver=ros2", "backend.arm.port=/a", "backend.arm.joint_names=[a]"], r"joint_names has 1 names, .* has 5 joints"),
        (
            ["backend.arm.driver=ros2", "backend.arm.port=/a", "backend.arm.ros2.full_effort=[1]"],
            r"full_effort has 1 values, .* has 5 joints",
        ),
        (["backend.arm.driver=python", "backend.arm.port=no_such:Arm"], "there is no module no_such"),
    ],
)
def test_words_that_make_no_sense_are_refused_before_a_port_is_opened(composed, words, told):
    words = ["backend=serial", "sensor=ndir", "profile=datasheet", "backend.nose.driver=scd30", "backend.nose.port=/dev/null", *words]
    with pytest.raises(BadInput, match=told):  # noqa: SIM117
        with open_bench(composed(*words)):
            pass


def open_bench(cfg):
    try:
        return instantiate(cfg.backend, _convert_="all").open()
    except InstantiationException as error:
        raise error.__cause__ from None


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fault", "told"),
    [
        ("raises", r"user_arm:Arm: read\(\) raised ValueError: protective stop, joint 2 \(user_arm\.py, line \d+\)"),
        ("hangs", r"backend\.arm\.port=user_arm:Arm hangs: a call has not returned for"),
        ("stale", r"the arm was stopped: the joints have said the same for"),
        ("jumps", r"the arm was stopped: joint shoulder_pan jumped by 40 degrees"),
    ],
)
def test_a_fault_of_the_object_ends_the_run_with_one_clear_line(ur5e, fault, told):
    run = ur5e(*SHORT, "backend.timeouts.reconnect_s=2", FAULT=fault, AFTER_S="6")
    assert run.code == 1, run.said
    lines = [line for line in run.said.strip().splitlines() if line.startswith("oio: ")]
    assert len(lines) == 1 and re.search(told, lines[0]), run.said
