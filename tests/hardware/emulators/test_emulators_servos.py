"""Emulated servos: goals come back as positions, tables keep what may be written, heat lets go; never a crash."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hardware.codecs import dynamixel as dxl
from hardware.codecs import sts
from hardware.emulators import dynamixel as dynamixel_bus
from hardware.emulators.dynamixel import Dynamixel
from hardware.emulators.feetech import Feetech

STEP = 2 * math.pi / 4096
COUNT = st.integers(0, 4095)


class Following:
    """Joints that are at once where they are sent."""

    def __init__(self, count=5):
        self.count, self.q, self.dq, self.load = count, np.zeros(count), np.zeros(count), np.zeros(count)

    def angles(self):
        return self.q

    def speeds(self):
        return self.dq

    def loads(self):
        return self.load

    def steer(self, joint, goal_rad):
        self.q = self.q.copy()
        self.q[joint] = goal_rad


class OfFeetech:
    """A host, as far as the tests need one."""

    wire, torque, goal, position = sts, sts.TORQUE_ENABLE, sts.GOAL_POSITION, sts.PRESENT_POSITION
    temperature, model, number = sts.PRESENT_TEMPERATURE, sts.MODEL, 777

    def __init__(self, count=5):
        self.joints, self.trouble = Following(count), set()
        self.bus = Feetech(self.joints, self.trouble)

    def ask(self, question):
        """(id, error, params) of each answer."""
        return [(p.id, p.code, p.params) for p in sts.Packets().feed(self.bus.answer(question))]

    def get(self, id, register):
        ((_, _, params),) = self.ask(self.wire.read(id, *register))
        return int.from_bytes(params, "little")

    def put(self, id, register, value):
        """The error."""
        ((_, error, _),) = self.ask(self.wire.write(id, register.address, value.to_bytes(register.length, "little", signed=value < 0)))
        return error


class OfDynamixel(OfFeetech):
    wire, torque, goal, position = dxl, dxl.TORQUE_ENABLE, dxl.GOAL_POSITION, dxl.PRESENT_POSITION
    temperature, model, number = dxl.PRESENT_TEMPERATURE, dxl.MODEL, 1020

    def __init__(self, count=5):
        self.joints, self.trouble = Following(count), set()
        self.bus = Dynamixel(self.joints, self.trouble)

    def ask(self, question):
        return [(p.id, p.error, p.params) for p in dxl.Packets().feed(self.bus.answer(question))]


both = pytest.mark.parametrize("host", [OfFeetech, OfDynamixel])


@given(st.lists(st.binary(max_size=40), max_size=8))
def test_no_bytes_whatever_upset_them(chunks):
    for host in (OfFeetech(), OfDynamixel()):
        for t_s, chunk in enumerate(chunks):
            assert isinstance(host.bus.answer(chunk), bytes)
            assert host.bus.tick(float(t_s)) == b""


@given(st.integers(0, 5), st.sampled_from([1, 2, 3, 7, 8, 10]), st.binary(max_size=12))
def test_no_instruction_whatever_upsets_them(id, instruction, params):
    for host in (OfFeetech(), OfDynamixel()):
        for each in (id, 254):
            for ins in (instruction, 0x82, 0x83):
                assert {who for who, _, _ in host.ask(host.wire.instruction(each, ins, params))} <= set(range(1, 6))


@both
@given(counts=st.lists(COUNT, min_size=5, max_size=5))
def test_a_goal_comes_back_as_position(host, counts):
    host = host()
    for id in range(1, 6):
        host.put(id, host.torque, 1)
    length = host.goal.length
    assert host.ask(host.wire.sync_write(host.goal.address, {i + 1: c.to_bytes(length, "little") for i, c in enumerate(counts)})) == []
    answers = host.ask(host.wire.sync_read(*host.position, [1, 2, 3, 4, 5]))
    assert [id for id, _, _ in answers] == [1, 2, 3, 4, 5]
    assert [int.from_bytes(params, "little") for _, _, params in answers] == counts
    np.testing.assert_allclose(host.joints.q, (np.array(counts) - 2048) * STEP, atol=1e-12)


@both
@given(count=COUNT)
def test_without_torque_a_goal_moves_nothing_until_torque_comes(host, count):
    host = host()
    host.put(2, host.goal, count)
    assert host.joints.q[1] == 0.0 and host.get(2, host.position) == 2048
    host.put(2, host.torque, 1)
    assert host.get(2, host.position) == count
    host.put(2, host.torque, 0)
    host.put(2, host.goal, 2048)
    assert host.get(2, host.position) == count


@given(COUNT, st.integers(-2047, 2047))
def test_the_homing_offset_of_feetech_turns_the_scale_within_one_turn(count, offset):
    host = OfFeetech()
    host.joints.steer(0, (count - 2048) * STEP)
    host.put(1, sts.LOCK, 0)
    host.put(1, sts.HOMING_OFFSET, sts.magnitude(offset, 11))
    assert host.get(1, host.position) == (count - offset) % 4096
    host.put(1, host.goal, (count - offset) % 4096)
    host.put(1, host.torque, 1)
    assert (host.joints.q[0] / STEP + 2048) % 4096 == pytest.approx(count, abs=1e-6)


@given(COUNT, st.integers(-5000, 5000))
def test_the_homing_offset_of_dynamixel_shifts_it(count, offset):
    host = OfDynamixel()
    host.joints.steer(0, (count - 2048) * STEP)
    host.put(1, dxl.HOMING_OFFSET, offset)
    assert np.int32(np.uint32(host.get(1, host.position))) == count + offset


@both
def test_each_answers_to_its_id_alone(host):
    host = host(3)
    assert host.get(2, host.model) == host.number
    assert [id for id, _, _ in host.ask(host.wire.ping(3))] == [3]
    assert host.ask(host.wire.ping(4)) == [] and host.ask(host.wire.read(9, *host.model)) == []
    assert [id for id, _, _ in host.ask(host.wire.sync_read(*host.position, [3, 9, 1]))] == [3, 1]


@both
def test_speed_and_load_are_read_with_their_signs(host):
    host = host()
    host.joints.dq[0], host.joints.load[0] = -1.0, -0.25
    if host.wire is sts:
        assert sts.signed(host.get(1, sts.PRESENT_VELOCITY), 15) == round(-1.0 / STEP)
        assert sts.signed(host.get(1, sts.PRESENT_LOAD), 10) == -250
        assert host.get(1, sts.MOVING) == 1 and host.get(2, sts.MOVING) == 0
    else:
        assert np.int32(np.uint32(host.get(1, dxl.PRESENT_VELOCITY))) * 0.229 * 2 * math.pi / 60 == pytest.approx(-1.0, abs=0.02)
        assert np.int16(np.uint16(host.get(1, dxl.PRESENT_CURRENT))) == round(-0.25 * 1193)


@both
def test_the_answer_waits_for_the_return_delay_of_each(host):
    host = host()
    host.ask(host.wire.sync_read(*host.position, [1, 2, 3]))
    assert host.bus.pause_s == pytest.approx(3 * 500e-6)
    for id in (1, 2, 3):
        if host.wire is sts:
            host.put(id, sts.LOCK, 0)
        host.put(id, host.wire.RETURN_DELAY, 0)
    host.ask(host.wire.sync_read(*host.position, [1, 2, 3]))
    assert host.bus.pause_s == 0.0


def test_the_eprom_of_feetech_is_written_only_unlocked():
    host = OfFeetech()
    host.put(1, sts.RETURN_DELAY, 3)
    assert host.get(1, sts.RETURN_DELAY) == 250
    host.put(1, sts.LOCK, 0)
    host.put(1, sts.RETURN_DELAY, 3)
    host.put(1, sts.PRESENT_VOLTAGE, 3)  # read-only
    host.put(1, sts.MODEL, 3)
    assert (host.get(1, sts.RETURN_DELAY), host.get(1, sts.PRESENT_VOLTAGE), host.get(1, sts.MODEL)) == (3, 74, 777)


def test_the_eeprom_of_dynamixel_is_written_only_without_torque():
    host = OfDynamixel()
    host.put(1, dxl.TORQUE_ENABLE, 1)
    assert host.put(1, dxl.RETURN_DELAY, 3) == dynamixel_bus.ACCESS and host.get(1, dxl.RETURN_DELAY) == 250
    host.put(1, dxl.TORQUE_ENABLE, 0)
    assert host.put(1, dxl.RETURN_DELAY, 3) == 0 and host.get(1, dxl.RETURN_DELAY) == 3
    assert host.put(1, dxl.PRESENT_POSITION, 3) == dynamixel_bus.ACCESS
    assert host.put(1, dxl.GOAL_POSITION, 5000) == dynamixel_bus.DATA_LIMIT and host.get(1, dxl.GOAL_POSITION) == 2048


def test_a_goal_beyond_the_limits_of_feetech_ends_at_them():
    host = OfFeetech()
    host.put(1, sts.LOCK, 0)
    host.put(1, sts.MIN_POSITION, 1000)
    host.put(1, sts.MAX_POSITION, 3000)
    host.put(1, sts.TORQUE_ENABLE, 1)
    host.put(1, sts.GOAL_POSITION, 4000)
    assert host.get(1, sts.PRESENT_POSITION) == 3000
    host.put(1, sts.GOAL_POSITION, sts.magnitude(-5, 15))
    assert host.get(1, sts.PRESENT_POSITION) == 1000


@both
def test_a_servo_that_overheats_says_so_and_lets_go(host):
    host = host()
    host.put(2, host.torque, 1)
    host.put(3, host.torque, 1)
    for tick in range(1, 151):
        host.bus.tick(0.02 * tick)
        host.trouble.add("hot")
    assert host.get(2, host.temperature) > 80 and host.get(3, host.temperature) == 30
    assert host.get(2, host.torque) == 0 and host.get(3, host.torque) == 1
    assert host.ask(host.wire.ping(2))[0][1] & (sts.OVERHEAT if host.wire is sts else dxl.ALERT)
    assert host.ask(host.wire.ping(3))[0][1] == 0
    host.put(2, host.goal, 2500)
    host.put(2, host.torque, 1)
    host.bus.tick(3.02)
    assert host.get(2, host.torque) == 0
    host.trouble.clear()
    for tick in range(151, 400):
        host.bus.tick(0.02 * tick)
    assert host.get(2, host.temperature) == 30
    host.put(2, host.torque, 1)
    assert host.get(2, host.torque) == int(host.wire is sts)  # a Dynamixel wants to be rebooted first
    if host.wire is dxl:
        host.ask(dxl.instruction(2, dynamixel_bus.REBOOT))
        host.put(2, host.torque, 1)
        assert host.get(2, host.torque) == 1


@both
def test_positions_stick_and_loads_saturate(host):
    host = host()
    host.trouble.add("stuck")
    host.joints.q = np.full(5, 0.5)
    assert host.get(1, host.position) == 2048
    host.trouble.clear()
    assert host.get(1, host.position) == 2048 + round(0.5 / STEP)
    host.trouble.add("saturated")
    assert host.get(1, sts.PRESENT_LOAD) == 1000 if host.wire is sts else host.get(1, dxl.PRESENT_CURRENT) == 1193


@both
def test_refusing_it_does_nothing_and_says_so(host):
    host = host()
    host.trouble.add("nack")
    assert host.put(1, host.torque, 1) != 0
    assert host.ask(host.wire.read(1, *host.position))[0][1:] != (0, b"") and host.ask(host.wire.read(1, *host.position))[0][2] == b""
    host.trouble.clear()
    assert host.get(1, host.torque) == 0
