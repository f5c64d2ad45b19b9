"""Emulators at their ptys: time is the plant's, answers wait for the wire, plugs go and come, and nothing is left behind."""

import os
import re
import select
import signal
import subprocess
import sys
import termios
import time
from pathlib import Path

import numpy as np
import pytest

from hardware.codecs import dynamixel, modbus, scd4x, shdlc, sts
from hardware.codecs.line import Lines
from hardware.emulators import options
from hardware.emulators.emulated_bench import emulate_bench
from hardware.emulators.line import BOOT_S
from hardware.emulators.realtime_plant import MAX_LATE_S, RealtimePlant
from oio.core.errors import BadInput
from oio.core.records import JointState
from oio.testing import check_live_backend

pytestmark = pytest.mark.long

ROOT = Path(__file__).resolve().parents[3]
KEYS = ROOT / "conf" / "emulate.yaml"
QUIET = ("air=steady", "dof=3")
SPEED = 2.0


class Host:
    """The other end of a port."""

    def __init__(self, path):
        self._fd = os.open(path, os.O_RDWR | os.O_NOCTTY)
        termios.tcflush(self._fd, termios.TCIFLUSH)

    def __enter__(self):
        return self

    def __exit__(self, *error):
        os.close(self._fd)

    def write(self, data):
        os.write(self._fd, data)

    def read(self, within_s=0.5):
        """What comes next; nothing if nothing comes; OSError or b'' at the end."""
        return os.read(self._fd, 4096) if select.select([self._fd], [], [], within_s)[0] else b""

    def ask(self, question, framer, tries=40):
        """The first frame that answers; asked again where the device had not seen yet that its port is open."""
        for _ in range(tries):
            self.write(question)
            until = time.monotonic() + 0.5
            while time.monotonic() < until:
                if frames := framer.feed(self.read(0.1)):
                    return frames
        raise AssertionError("no answer")


@pytest.fixture
def up(built, tmp_path):
    """up(nose="scd30", faults=...): the emulated bench and its ports."""

    def made(*overrides, speed=SPEED, **own):
        chosen, words = options.read([f"{key}={value}" for key, value in {"speed": speed, "out": tmp_path, **own}.items()], KEYS)
        return emulate_bench(chosen, built("backend", *QUIET, *words, *overrides))

    return made


class Ack(Lines):
    """Acknowledgements alone."""

    def feed(self, data):
        return [fields for fields in super().feed(data) if fields[0] == "ACK"]


class Clock:
    """Goes on when told."""

    def __init__(self):
        self.t_s = 100.0

    def __call__(self):
        return self.t_s


@pytest.fixture
def realtime(built):
    sim, clock = built("backend", *QUIET, "sensor=ndir"), Clock()
    with sim.plant() as plant:
        yield RealtimePlant(plant, sim.arm, 4.0, clock), plant, clock


def test_angles_go_evenly_from_tick_to_tick(realtime):
    realtime, plant, clock = realtime
    realtime.begin()
    for _ in range(5):
        realtime.steer(0, 0.3)
        realtime.tick()
        clock.t_s += 0.005
    before, after = realtime._before, realtime._after
    assert realtime.t_s == pytest.approx(before.t_s + 0.02) and np.max(np.abs(after.angles - before.angles)) > 1e-4
    for share in (0.0, 0.25, 0.9, 1.0, 5.0):
        clock.t_s = 100.0 + (before.t_s + 0.02 * share) / 4.0
        np.testing.assert_allclose(realtime.angles(), before.angles + min(share, 1.0) * (after.angles - before.angles), atol=1e-12)
    np.testing.assert_allclose(realtime.speeds(), (after.angles - before.angles) / 0.02, rtol=1e-9)
    np.testing.assert_array_equal(realtime.angles()[:3], plant.fine_angles())


def test_locked_joints_stay_at_home(realtime):
    realtime, _, clock = realtime
    for joint in range(5):
        realtime.steer(joint, 0.2)
    for _ in range(20):
        realtime.tick()
    clock.t_s += 1.0
    assert realtime.count == 5
    np.testing.assert_array_equal(realtime.angles()[3:], [0.9, 0.0])
    np.testing.assert_allclose(realtime.angles()[:3], 0.2, atol=0.05)


def test_ticks_are_due_by_the_plants_time_and_lost_time_is_given_up(realtime):
    realtime, _, clock = realtime
    realtime.begin()
    assert realtime.due_s == 100.0
    realtime.tick()
    assert realtime.due_s == pytest.approx(100.005) and realtime.slipped_s == 0.0
    clock.t_s = 100.005 + 1.1 * MAX_LATE_S
    realtime.tick()
    assert realtime.slipped_s == pytest.approx(1.1 * MAX_LATE_S)
    assert realtime.due_s == pytest.approx(clock.t_s + 0.005)


def test_the_nose_smells_what_the_valve_lets_out(up):
    """A beacon at home: the plant behind both ports is one."""
    with (
        up("beacon.position=[0.34,0.0,0.15]", nose="scd30", arm="none") as bench,
        bench.loop.running(),
        Host(bench.ports["nose"]) as nose,
        Host(bench.ports["valve"]) as valve,
    ):

        def ppm():
            (reply,) = nose.ask(modbus.read_request(0x61, 0x28, 6), modbus.Replies(0x61))
            return modbus.floats(reply.words)[0]

        time.sleep(0.3)
        before = ppm()
        assert valve.ask(b"V1\n", Lines())[0][:2] == ("ACK", "V1")
        time.sleep(2.0)
        assert ppm() > before + 100.0


def test_an_scd41_and_a_dynamixel_arm(up):
    with (
        up(nose="scd41", arm="dynamixel") as bench,
        bench.loop.running(),
        Host(bench.ports["nose"]) as nose,
        Host(bench.ports["arm"]) as arm,
    ):
        frame = nose.ask(shdlc.mosi(0, scd4x.DEVICE_INFO, b"\x01"), shdlc.Miso())[0]
        assert frame.data == b"SEK-SensorBridge\0"
        packets = arm.ask(dynamixel.sync_read(*dynamixel.PRESENT_POSITION, range(1, 6)), dynamixel.Packets())
        assert packets[0].id == 1 and packets[0].error == 0


def test_servos_follow_goals_and_say_where_they_are(up):
    with up(arm="feetech") as bench, bench.loop.running(), Host(bench.ports["arm"]) as arm:

        def positions():
            arm.write(sts.sync_read(*sts.PRESENT_POSITION, range(1, 6)))
            framer, found = sts.Packets(), []
            while len(found) < 5 and (data := arm.read(1.0)):
                found += framer.feed(data)
            return [int.from_bytes(p.params, "little") for p in found]

        arm.ask(sts.ping(1), sts.Packets())
        home = positions()
        np.testing.assert_allclose(home, 2048 + np.array([0.0, -1.0, 0.6, 0.9, 0.0]) / (2 * np.pi / 4096), atol=15)  # sag and counts
        goals = {i + 1: (count + 40).to_bytes(2, "little") for i, count in enumerate(home)}
        arm.write(sts.sync_write(sts.GOAL_POSITION.address, goals))
        for id in range(1, 6):
            arm.ask(sts.write(id, sts.TORQUE_ENABLE.address, b"\x01"), sts.Packets())
        time.sleep(1.0)
        moved = np.array(positions()) - home
        np.testing.assert_allclose(moved[:3], 40, atol=8)
        np.testing.assert_array_equal(moved[3:], 0)  # locked


def test_no_answer_is_sooner_than_its_wire_allows(up):
    """25 bytes at 19 200 baud take 13 ms; the host may wait longer, never less."""
    with up(nose="scd30", arm="none", speed=0.5) as bench, bench.loop.running(), Host(bench.ports["nose"]) as nose:
        question = modbus.read_request(0x61, 0x28, 6)
        nose.ask(question, modbus.Replies(0x61))
        for _ in range(5):
            asked_s, framer = time.monotonic(), modbus.Replies(0x61)
            nose.write(question)
            while not framer.feed(nose.read()):
                pass
            assert time.monotonic() - asked_s > 25 * 10 / 19_200 / 0.5


def test_frames_come_by_the_worlds_clock(up):
    """Speed 4: a frame of 0.1 s every 25 ms of the host, however late single ones are."""
    with up(nose="line", arm="none", speed=4.0) as bench, bench.loop.running(), Host(bench.ports["nose"]) as nose:
        framer, frames, began_s = Lines(), [], time.monotonic()
        while len(frames) < 40:
            frames += [fields for fields in framer.feed(nose.read()) if fields[0] == "NOSE"]
        ms = np.array([int(fields[1]) for fields in frames])
        assert framer.corrupt == 0
        np.testing.assert_array_equal(np.diff(ms), 100)
        slipped_s = bench.loop.realtime.slipped_s
        assert 4.0 * (time.monotonic() - began_s - slipped_s) > 3.9 - 0.2


def test_what_nobody_listens_to_is_lost_and_who_opens_the_port_resets_the_board(up):
    """As DTR does with an Arduino: it boots, and hears nothing meanwhile."""
    with up(nose="line", arm="none", speed=2.0) as bench, bench.loop.running():
        time.sleep(0.5)
        for _ in range(2):
            opened_s = time.monotonic()
            fd = os.open(bench.ports["nose"], os.O_RDWR | os.O_NOCTTY)  # without a flush
            try:
                framer, frames = Lines(), []
                while not frames:
                    os.write(fd, b"SB\n")
                    time.sleep(0.02)
                    frames = framer.feed(os.read(fd, 4096) if select.select([fd], [], [], 0.0)[0] else b"")
                first_ms = frames[0][2 if frames[0][0] == "ACK" else 1]  # a bench that was held up may give a report first
                assert int(first_ms) < 200  # the clock began when it had booted
                assert time.monotonic() - opened_s > 0.5 * BOOT_S / 2.0  # a bench that was held up makes up for it
            finally:
                os.close(fd)
            time.sleep(0.3)  # or the bench may not see that it was closed


def test_a_plug_that_is_pulled_comes_back_under_its_name(up):
    with up(nose="line", arm="none", faults="nose.unplug@4:2") as bench, bench.loop.running():
        path = bench.ports["nose"]
        with Host(path) as nose:
            assert nose.ask(b"SB\n", Ack())
            with pytest.raises((OSError, EOFError)):
                while True:
                    if not nose.read(3.0):
                        raise EOFError
        assert not path.exists()
        until = time.monotonic() + 10.0
        while not path.exists() and time.monotonic() < until:
            time.sleep(0.02)
        with Host(path) as nose:
            framer, frames = Lines(), []
            while not frames:
                frames = [fields for fields in framer.feed(nose.read(5.0)) if fields[0] == "NOSE"]
            assert int(frames[0][1]) < 3000 and frames[0][2] == "A"  # it has booted


@pytest.mark.parametrize("kind", ["noise", "cut", "checksum", "busy"])
def test_a_wire_in_trouble_gives_no_wrong_frame_and_recovers(up, kind):
    """Seconds of the schedule pass from the first question on."""
    emulate_bench = up(nose="line", arm="none", faults=f"nose.{kind}@1:2", speed=4.0)
    with emulate_bench as bench, bench.loop.running(), Host(bench.ports["nose"]) as nose:
        while not nose.read():
            pass  # it boots
        framer, ms = Lines(), []
        asked = int(nose.ask(b"SA\n", Ack())[0][2])
        while not ms or ms[-1] < asked + 4000:
            ms += [int(fields[1]) for fields in framer.feed(nose.read(3.0)) if fields[0] == "NOSE"]
        assert [t for t in ms if t < asked + 900] == list(range(ms[0], asked + 900, 100))
        assert [t for t in ms if t >= asked + 3200] == list(range(-(-(asked + 3200) // 100) * 100, ms[-1] + 1, 100))
        during = [t for t in ms if asked + 1100 <= t < asked + 2900]
        assert len(during) <= (17 if kind == "noise" else 0)  # noise between frames spares some
        assert framer.corrupt > 0 or kind == "busy"


def test_ports_are_taken_only_once_and_left_clean(up, tmp_path):
    with up():
        assert sorted(path.name for path in tmp_path.iterdir()) == ["arm", "nose", "valve"]
        with pytest.raises(BadInput, match=r"is there already.*another out="), up():
            pass
        assert (tmp_path / "nose").exists()
    assert not list(tmp_path.iterdir())
    (tmp_path / "nose").symlink_to(tmp_path / "nowhere")  # of an emulator that was killed
    with up() as bench:
        assert bench.ports["nose"].exists()


def test_an_error_in_the_loop_is_raised_at_the_end(up):
    def broken(set_point):
        raise ArithmeticError("physics")

    with up() as bench, pytest.raises(ArithmeticError, match="physics"):
        bench.plant.tick = broken
        with bench.loop.running():
            time.sleep(0.3)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["nose=mq"], r"nose=mq was given, but nose can be scd30, scd41, line"),
        (["valve=tap"], r"valve can be line, none"),
        (["speed=0"], r"speed is 0, but 0.1 to 100"),
        (["speed=fast"], r"speed is 'fast', but it must be a number"),
        (["backend=serial"], r"always backend=mujoco"),
        (["nose"], r"KEY=VALUE words are wanted"),
        (["dof=3", "dof=3"], r"dof was given twice"),
    ],
)
def test_bad_words_are_refused(words, says):
    with pytest.raises(BadInput, match=says):
        options.read(words, KEYS)


def test_the_sensor_follows_the_nose_unless_it_is_named(up):
    assert options.read(["nose=scd41"], KEYS)[1] == ["sensor=pa"]
    assert options.read(["nose=line", "sensor=mox_mq", "dof=2"], KEYS)[1] == ["sensor=mox_mq", "dof=2"]
    with pytest.raises(BadInput, match="sensor=ec goes with nose=line"), up("sensor=ec", nose="scd30"):
        pass


def started(*words):
    """The command and the line that it says when it is up."""
    command = [sys.executable, "-m", "hardware.emulate", *QUIET, *words]
    process = subprocess.Popen(command, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    return process, process.stdout.readline()


def test_the_command_is_up_prints_one_line_and_ends_cleanly():
    process, line = started("nose=line", "sensor=mox_mq", "seed=7", "until_eof=true")
    try:
        ports = dict(re.findall(r"backend\.(\w+)\.port=(\S+)", line))
        assert sorted(ports) == ["arm", "nose", "valve"] and all(Path(path).exists() for path in ports.values())
        assert "backend=serial sensor=mox_mq dof=3 seed=7 air=steady" in line and "backend.speed=1 " in line
        assert re.search(r"'source\.position=\[(-?[\d.]+,){2}-?[\d.]+\]'", line)
        process.send_signal(signal.SIGTERM)
        assert process.wait(timeout=30) == 0
        assert not Path(ports["nose"]).parent.exists()
        assert process.stdout.read() == ""
    finally:
        process.communicate()


def test_the_command_ends_with_its_input_if_asked():
    process, line = started("arm=none", "valve=none", "until_eof=true")
    assert "backend.arm.driver=none backend.valve.driver=none" in line
    process.stdin.close()
    assert process.wait(timeout=30) == 0
    for stream in (process.stdout, process.stderr):
        stream.close()


def test_the_command_refuses_in_one_paragraph():
    process, line = started("nose=line", "sensor=ndir", "until_eof=true")
    out, said = process.communicate(timeout=60)
    assert process.returncode == 2 and (line, out) == ("", "")
    assert said == "oio: sensor=ndir goes with nose=scd30 or nose=scd41, which say ppm, but nose=line was given.\n"


@pytest.mark.parametrize(
    ("sensor", "nose", "arm"), [("ndir", "scd30", "feetech"), ("pa", "scd41", "dynamixel"), ("mox_mq", "line", "none")]
)
def test_a_bench_at_emulated_ports_is_a_live_backend(up, built, sensor, nose, arm):
    with up(f"sensor={sensor}", "arm.encoder_drift_deg_s2=0", nose=nose, arm=arm) as bench, bench.loop.running():
        words = [f"backend.{key}.port={port}" for key, port in bench.ports.items()]
        words += [
            f"backend.speed={SPEED:g}",
            f"backend.nose.driver={nose}",
            f"backend.arm.driver={arm}",
            "backend.valve.driver=line",
            "safety.heartbeat_timeout_s=10",
            "backend.timeouts.connect_s=20",
        ]
        check_live_backend(built("backend", "backend=serial", *QUIET, f"sensor={sensor}", *words), for_s=3.0)


def test_who_holds_the_arm_is_told_to_let_go_before_it_goes_home(up, built, capsys):
    """The arm was left away from home; the second opening says so, waits, and brings it home."""
    with up("sensor=ndir", "arm.encoder_drift_deg_s2=0", nose="scd30", arm="feetech") as bench, bench.loop.running():
        words = [f"backend.{key}.port={port}" for key, port in bench.ports.items()]
        words += ["backend.nose.driver=scd30", "backend.arm.driver=feetech", "backend.valve.driver=line", f"backend.speed={SPEED:g}"]
        serial = built(
            "backend", "backend=serial", *QUIET, "sensor=ndir", "safety.heartbeat_timeout_s=10", "backend.timeouts.connect_s=20", *words
        )
        home = serial.kinematics.home
        for said in ("", "oio: the arm holds itself. Hands off: it goes home in 3 s.\n"):
            with serial.open() as world:
                assert capsys.readouterr().err == said
                for _ in range(20):  # a bench that was held up may bring it home a little later
                    q = [s.q for s in world.samples(0.5) if isinstance(s, JointState)][-1]
                    if np.max(np.abs(q - home)) < 0.05:
                        break
                assert np.max(np.abs(q - home)) < 0.05
                goal = home + np.array([0.4, 0.0, 0.0])
                for _ in world.samples(world.move(goal, 1.0) + 0.5):
                    pass
