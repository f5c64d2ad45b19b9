"""Homing: a person who is told which end is which, zeros and directions that follow, what is refused, what reaches the filter."""

import io
import json
import math
import re
from dataclasses import replace

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console

from hardware import home
from hardware.drivers.servos import homing_procedure
from hardware.drivers.servos.bus import ServoState
from hardware.drivers.servos.end_directions import end_directions
from hardware.drivers.servos.joint_calibration import JointSweep, ends_deg, homing_from_sweeps
from oio.core.errors import BadInput, OioError
from oio.inference.forward_model import ParameterLayout
from oio.inference.prior import nominal_prior
from oio.kinematics.homing import Homing
from oio.kinematics.homing_file import read_homing

TURN = 4096
DEGREES = 360.0 / TURN


COMPARED = [(0, 40.0, False), (1, -30.0, False), (2, 35.0, False), (3, -25.0, False), (4, 50.0, True), (4, 50.0, True)]
DIRECTIONS = {"forward": (0, 1), "back": (0, -1), "to the arm's left": (1, 1), "to the arm's right": (1, -1), "up": (2, 1), "down": (2, -1)}


@pytest.fixture(scope="module")
def arm(built):
    return built("arm")


def turned_like(arm, zeros, signs, misfit_deg=0.0):
    """Joints that were turned from LOW to HIGH, each end `misfit_deg` / 2 short of the MJCF's."""
    rounds = []
    for i, (zero, sign) in enumerate(zip(zeros, signs, strict=True)):
        low, high = ends_deg(arm, i)
        turned = JointSweep(arm.all_names[i], TURN, (low, high))
        turned.add(round(zero + sign * (low + misfit_deg / 2) / DEGREES))
        turned.stop()
        for degrees in np.linspace(low + misfit_deg / 2, high - misfit_deg / 2, 40):
            turned.add(round(zero + sign * degrees / DEGREES))
        turned.stop()
        rounds.append(turned)
    return rounds


class Servos:
    """A bus whose servos are mounted somehow; somebody holds the arm at `degrees`."""

    name, baud, counts_per_turn, middle = "fake", 1, TURN, TURN // 2

    def __init__(self, zeros, signs, degrees):
        self.zeros, self.signs, self.degrees, self.holds = np.array(zeros), np.array(signs), np.array(degrees), True

    def ping(self, wire, servo):
        return self.name

    def configure(self, wire, ids):
        assert list(ids) == [1, 2, 3, 4, 5]

    def torque(self, wire, ids, on):
        self.holds = on

    def read_state(self, wire, ids):
        counts = np.rint(self.zeros + self.signs * self.degrees / DEGREES).astype(np.int64)
        return ServoState(counts, np.zeros(len(ids)), None)


class Person:
    """Presses Enter to let go, then turns joints to `goals` (joint, degrees, whether Enter is pressed there), a step per look."""

    def __init__(self, servos, goals):
        self.servos, self.goals, self.goal = servos, iter(goals), None

    def __call__(self, wait_s):
        assert self.servos.holds == (self.goal is None)
        if self.goal is not None:
            i, degrees, enter = self.goal
            left = degrees - self.servos.degrees[i]
            self.servos.degrees[i] += np.clip(left, -7.0, 7.0)
            if abs(left) > 7.0:
                return False
        pressed = self.goal is None or enter
        self.goal = next(self.goals, (0, 0.0, False))
        return pressed


def obedient(arm, rounds=2):
    """The goals of a person who does as told: all joints to LOW, then to HIGH."""
    return [(i, degrees, True) for _ in range(rounds) for i in range(5) for degrees in ends_deg(arm, i)]


@pytest.fixture
def walk(monkeypatch, arm, tmp_path):
    """What was shown to a person with these goals, and the file."""

    def walked(servos, goals, repeats=2):
        console, file = Console(record=True, width=300, file=io.StringIO()), tmp_path / "homing.json"
        monkeypatch.setattr(homing_procedure, "_entered", Person(servos, [*goals, *COMPARED]))
        try:
            homing_procedure.run_procedure(console, servos, None, arm, repeats, file)
        except OioError:
            assert not file.exists()
            raise
        return console.export_text(), str(file)

    return walked


@pytest.mark.parametrize("signs", [(1, 1, 1, 1, 1), (-1, 1, 1, 1, 1), (1, -1, 1, -1, -1), (-1, -1, -1, -1, -1)])
def test_a_person_who_does_as_told_homes_mirrored_joints_too(arm, walk, signs):
    servos = Servos((2048, 1990, 2100, 2000, 2060), signs, np.degrees(arm.home))
    told, file = walk(servos, obedient(arm))
    assert told.count(" LOW end (") == told.count(" HIGH end (") == 10 and told.count("fall") == signs.count(-1)
    assert "the nose 0.34 m in front of the base's origin, 0.00 m to its left, 0.13 m above" in told
    assert "LOW end (-100 degrees; from home the nose goes up)" in told and "HIGH end (100 degrees; from home the nose goes down)" in told
    homing, servos.degrees = read_homing(str(file), np.zeros(5), np.zeros(5)), np.array([20.0, -50.0, 30.0, 60.0, -70.0])
    angles_deg = np.degrees(homing.angles(servos.read_state(None, range(5)).counts, TURN))
    assert homing.sign == signs and angles_deg == pytest.approx(servos.degrees, abs=3 * DEGREES)


def test_enter_pressed_twice_at_the_same_end_is_refused_at_once(arm, walk):
    servos, (low, high) = Servos((2048,) * 5, (1,) * 5, np.degrees(arm.home)), ends_deg(arm, 1)
    goals = [*obedient(arm)[:2], (1, high, False), (1, low, True), (1, low + 5, True)]
    with pytest.raises(OioError, match=r"shoulder_elevation was at 910 counts when .* LOW end and at 967 for its HIGH end: .* same side"):
        walk(servos, goals)


def test_a_round_that_went_the_other_way_is_refused(arm, walk):
    servos, goals = Servos((2048,) * 5, (1,) * 5, np.degrees(arm.home)), obedient(arm)
    goals[14:16] = goals[14:16][::-1]  # elbow, round 2
    with pytest.raises(
        OioError, match=r"elbow_tilt was turned from LOW to HIGH one way in round 1 and the other way in round 2: .*mirrored"
    ):
        walk(servos, goals)


@pytest.mark.parametrize("swapped", range(5))
def test_ends_that_were_swapped_in_every_round_are_seen_with_a_ruler(arm, walk, swapped):
    """But for the roll, which the nose does not feel."""
    servos, goals = Servos((2048,) * 5, (1,) * 5, np.degrees(arm.home)), obedient(arm)
    for k in (0, 10):
        a = k + 2 * swapped
        goals[a : a + 2] = goals[a : a + 2][::-1]
    told, _ = walk(servos, goals)
    said = np.array([float(x) for x in re.search(r"should now be ([\d.-]+) m .*?, ([\d.-]+) m .*?, ([\d.-]+) m", told).groups()])
    off_m = np.linalg.norm(said - arm.nose(np.radians(servos.degrees)))
    assert off_m < homing_procedure.AGREES_M if swapped == 4 else off_m > 2 * homing_procedure.AGREES_M


def test_a_joint_that_turns_too_far_is_sent_to_tape_marks_and_is_homed_with_them(arm, walk):
    servos, goals = Servos((2048,) * 5, (1, 1, 1, 1, -1), np.degrees(arm.home)), obedient(arm, 1)
    marks = "put tape marks at -157 and 163 degrees from its middle"
    with pytest.raises(OioError, match=rf"wrist_roll was turned by 340 degrees, but .* 320 degrees apart\. .*, or {marks}"):
        walk(servos, [*goals[:8], (4, -167.0, True), (4, 173.0, True)], 1)
    with pytest.raises(OioError, match=rf"wrist_roll jumped .* if the joint turns on without end, {marks}"):
        walk(endless(arm), [*goals[:8], (4, -270.0, True)], 1)
    servos.holds = True
    _, file = walk(servos, [*goals[:8], (4, -157.0, True), (4, 170.0, False), (4, 163.0, True)], 1)  # it began past its mark: it was at 173
    homing = read_homing(str(file), np.zeros(5), np.zeros(5))
    assert homing.sign[4] == -1 and abs(homing.zero_counts[4] - 2048) <= 4 and homing.u_deg[4] < 0.5


def test_a_joint_that_sagged_from_its_stop_before_enter_costs_nothing(arm, walk):
    servos, (low, high) = Servos((2048,) * 5, (1,) * 5, np.degrees(arm.home)), ends_deg(arm, 1)
    goals = obedient(arm, 1)
    _, file = walk(servos, [*goals[:2], (1, low, False), (1, low + 20, True), (1, high, False), (1, high - 9, True), *goals[4:]], 1)
    assert (
        read_homing(str(file), np.zeros(5), np.zeros(5)).zero_counts == (2048,) * 5
        and read_homing(str(file), np.zeros(5), np.zeros(5)).u_deg[1] < 0.5
    )


def endless(arm):
    """An arm whose roll goes around and around."""
    servos = Servos((2048,) * 5, (1,) * 5, np.degrees(arm.home))
    read_state = servos.read_state
    servos.read_state = lambda wire, ids: ServoState(read_state(wire, ids).counts % TURN, np.zeros(5), None)
    return servos


def test_the_words_are_what_mujoco_does(arm):
    """A little way from home and, for joints that move the nose, all the way at the end."""
    model = mujoco.MjModel.from_xml_path(str(arm.path))
    begin, turn, anchors, _ = posed(model, arm.home)
    for i, words in enumerate(end_directions(arm)):
        for word, end, side in zip(words, (arm.low_rad[i], arm.high_rad[i]), (-1, 1), strict=True):
            q = arm.home.copy()
            q[i] += 0.01 * side
            nudged, turned, _, _ = posed(model, q)
            moved = nudged - begin
            if "rolls" in word:
                ahead = (begin - anchors[i]) @ axis_of(turned @ turn.T)
                assert ("counterclockwise" in word) == (ahead < 0) and np.linalg.norm(moved) < 2e-4
                continue
            axis, sign = DIRECTIONS[word.removeprefix("the nose goes ")]
            q[i] = end
            assert np.argmax(np.abs(moved)) == axis and sign * moved[axis] > 0 and sign * (posed(model, q)[0] - begin)[axis] > 0.1


def posed(model, q):
    """Place and attitude of the nose, and where the joints are and point, for joints q."""
    data = mujoco.MjData(model)
    data.qpos[:] = q
    mujoco.mj_kinematics(model, data)
    return data.site("nose").xpos, data.site("nose").xmat.reshape(3, 3), data.xanchor, data.xaxis


def axis_of(rotation):
    """About which a small rotation turns, right-handed."""
    return np.array([rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]])


def test_the_words_of_the_so101(arm, built):
    assert end_directions(arm) == [
        ("the nose goes to the arm's left", "the nose goes to the arm's right"),
        ("the nose goes up", "the nose goes down"),
        ("the nose goes up", "the nose goes down"),
        ("the nose goes up", "the nose goes down"),
        ("the nose rolls clockwise, seen from behind it", "the nose rolls counterclockwise, seen from behind it"),
    ]
    assert end_directions(home.described("gantry", ()))[0] == ("the nose goes back", "the nose goes forward")


@given(shift=st.lists(st.integers(-200, 200), min_size=5, max_size=5), signs=st.lists(st.sampled_from([-1, 1]), min_size=5, max_size=5))
def test_zero_and_direction_come_back_whatever_servo_it_is_and_however_it_is_mounted(arm, shift, signs):
    zeros = [2048 + s for s in shift]
    homing = homing_from_sweeps([turned_like(arm, zeros, signs)] * 2, arm, TURN)
    assert np.max(np.abs(np.array(homing.zero_counts) - zeros)) <= 1 and homing.sign == tuple(signs)
    play = arm.backlash_deg / 2 / math.sqrt(3)
    assert np.array(homing.u_deg) == pytest.approx(play, rel=0.1)


def test_an_end_that_was_not_reached_costs_certainty_and_then_is_refused(arm):
    zeros, signs = [2048] * 5, (1,) * 5
    sure = homing_from_sweeps([turned_like(arm, zeros, signs)], arm, TURN)
    doubtful = homing_from_sweeps([turned_like(arm, zeros, signs, 10.0)], arm, TURN)
    assert min(doubtful.u_deg) == pytest.approx(math.hypot(5.0 / math.sqrt(3), sure.u_deg[0]), rel=0.02)
    with pytest.raises(OioError, match="shoulder_azimuth was turned by 200 degrees, but its ends in the MJCF are 220"):
        homing_from_sweeps([turned_like(arm, zeros, signs, 20.0)], arm, TURN)


def test_a_wrap_inside_the_range_is_refused_with_what_to_do():
    turned = JointSweep("elbow_flex", TURN, (-97.0, 97.0))
    for counts in range(3000, 4096, 50):
        turned.add(counts)
    with pytest.raises(OioError, match=r"elbow_flex jumped from 4050 to 4: .*wraps.*2048.*home again"):
        turned.add(4)


@given(q=st.lists(st.floats(-1.5, 1.5), min_size=5, max_size=5), signs=st.lists(st.sampled_from([-1, 1]), min_size=5, max_size=5))
def test_angles_and_counts_undo_each_other_to_half_a_count(q, signs):
    homing = Homing((2048, 1900, 2100, 2000, 2222), tuple(signs), (0.0,) * 5)
    back = homing.angles(homing.counts(np.array(q), TURN), TURN)
    assert np.max(np.abs(back - q)) <= math.pi / TURN * (1 + 1e-9)


def test_the_uncertainty_of_homing_reaches_the_covariance_of_the_filter(built, tmp_path):
    file = tmp_path / "homing.json"
    Homing((2048,) * 5, (1,) * 5, (0.3, 0.4, 0.5, 0.6, 2.0)).write(file)
    plain, homed = built("arm"), built("arm", f"arm.homing={file}")
    law, nominal = built("range_law"), built("nominal")
    offsets = np.zeros(nominal.elements), np.ones(nominal.elements)
    (_, without), (_, with_it) = (nominal_prior(a, law, nominal, *offsets) for a in (plain, homed))
    n = ParameterLayout(5, nominal.elements).offset
    more = np.degrees(np.sqrt(np.diag(with_it)[n])) ** 2 - np.degrees(np.sqrt(np.diag(without)[n])) ** 2
    assert np.sqrt(more) == pytest.approx([0.3, 0.4, 0.5, 0.6, 2.0], rel=1e-3)


@pytest.mark.parametrize(
    "text",
    ["", "[]", "{}", '{"zero_counts": [1], "sign": [1], "u_deg": [1]}', '{"zero_counts": 1, "sign": 1, "u_deg": 1}', "__import__('os')"],
)
def test_a_file_that_is_no_homing_is_refused(built, tmp_path, text):
    file = tmp_path / "homing.json"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(BadInput, match=r"arm\.homing=.*python -m hardware\.home"):
        replace(built("arm"), homing=str(file))


@pytest.mark.parametrize("broken", [{"sign": [1, 1, 1, 1, 0]}, {"u_deg": [0, 0, 0, 0, -1]}, {"zero_counts": [1, 2, 3, 4, "5"]}])
def test_figures_that_make_no_sense_are_refused(built, tmp_path, broken):
    file = tmp_path / "homing.json"
    sound = {"zero_counts": [2048] * 5, "sign": [1] * 5, "u_deg": [0.3] * 5}
    file.write_text(json.dumps(sound | broken), encoding="utf-8")
    with pytest.raises(BadInput, match=r"arm\.homing="):
        replace(built("arm"), homing=str(file))
