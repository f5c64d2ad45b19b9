"""Drivers and the devices they drive, face to face: no port, no thread, nothing in between."""

import re
import time
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hydra.utils import instantiate

from hardware.codecs import dynamixel, modbus, sts
from hardware.drivers.noses.reading_filter import ReadingFilter
from hardware.drivers.noses.scd30 import INTERVAL, Scd30
from hardware.drivers.noses.scd41 import Scd41
from hardware.drivers.servos.buses import BUSES
from hardware.drivers.servos.dynamixel import Dynamixel
from hardware.drivers.servos.feetech import Feetech
from hardware.emulators.device import Electronics
from hardware.emulators.dynamixel import CURRENT_LIMIT
from hardware.emulators.dynamixel import Dynamixel as DynamixelBus
from hardware.emulators.feetech import Feetech as FeetechBus
from hardware.emulators.scd30 import Scd30 as Part30
from hardware.emulators.scd41 import Scd41 as Part41
from hardware.emulators.scd41 import SensorBridge
from hardware.transport.mailbox import Mailbox
from hardware.transport.port import NoAnswer
from oio.core.errors import OioError
from oio.core.records import nanoseconds

IDS = [1, 2, 3, 4, 5]


class Beside:
    """A wire as short as can be; `sent` is what the driver wrote."""

    def __init__(self, device):
        self.device, self.sent, self._said = device, [], b""

    def write(self, data):
        self.sent.append(data)
        self._said += self.device.answer(data)

    def read(self, timeout_s):
        said, self._said = self._said, b""
        if not said:
            time.sleep(min(timeout_s, 0.001))
        return said


class Stepped:
    """A clock that a test sets; a host's second is one of the world's."""

    t_s = suspended_s = 0.0

    def now_ns(self):
        return nanoseconds(self.t_s)

    def host_s(self, world_s):
        return world_s


@pytest.fixture
def co2(monkeypatch):
    """co2("scd30", sample_s): the driver, its wire, its clock and the mailbox."""

    def make(name, sample_s):
        clock, box = Stepped(), Mailbox(100)
        electronics = Electronics(lambda element: 439.0, 40_000.0, set())
        device = Part30(electronics, 2.0, set()) if name == "scd30" else SensorBridge(Part41(electronics, 5.0), set())
        wire = Beside(device)
        sleeping = SimpleNamespace(sleep=lambda s: (setattr(clock, "t_s", clock.t_s + s), device.tick(clock.t_s)), monotonic=time.monotonic)
        for module in (f"hardware.drivers.noses.{name}", "hardware.drivers.noses.poll_schedule"):
            monkeypatch.setattr(f"{module}.time", sleeping)
        made = Scd30 if name == "scd30" else Scd41
        return made(ReadingFilter(box, 1, 40_000.0, 1000), clock, sample_s), wire, clock, box

    return make


@pytest.mark.parametrize(("name", "part_s"), [("scd30", 2.0), ("scd41", 5.0)])
@pytest.mark.parametrize("fast", [False, True])
def test_a_part_at_its_own_pace_is_never_taken_for_silent_nor_started_anew(co2, name, part_s, fast):
    """Sampled as often as it has something new, and as often as the paper asks."""
    nose, wire, clock, box = co2(name, 0.1 if fast else part_s)
    nose.configure(wire)
    begun = clock.t_s
    while clock.t_s < begun + 60.0:
        assert nose.poll(wire)  # resting is no silence
        clock.t_s += 0.01
        wire.device.tick(clock.t_s)
    assert len(box.gas) == pytest.approx(60.0 / part_s, abs=2)


@pytest.mark.parametrize(("name", "part_s"), [("scd30", 2.0), ("scd41", 5.0)])
def test_a_part_that_is_asked_promises_no_value_older_than_the_question(co2, name, part_s):
    nose, wire, clock, box = co2(name, part_s)
    nose.configure(wire)
    while len(box.gas) < 5:
        promised_ns, had, began_ns = box.gas_from_ns, len(box.gas), clock.now_ns()
        nose.poll(wire)
        if len(box.gas) > had:
            assert box.gas[-1].sample.t_ns == box.gas_from_ns == began_ns > promised_ns > 0
        clock.t_s += 0.01
        wire.device.tick(clock.t_s)


def test_a_rest_leaves_the_wire_alone(co2):
    nose, wire, clock, box = co2("scd30", 2.0)
    nose.configure(wire)
    while not box.gas:
        nose.poll(wire)
        clock.t_s += 0.1
        wire.device.tick(clock.t_s)
    asked = len(wire.sent)
    assert nose.poll(wire) and len(wire.sent) == asked


def test_flash_is_written_only_with_what_is_new(co2):
    nose, wire, _, _ = co2("scd30", 4.0)
    written = modbus.write_request(0x61, INTERVAL, 4)
    nose.configure(wire)
    nose.configure(wire)
    assert wire.sent.count(written) == 1


def servos(bus_of, driver):
    """The driver, its wire, the devices' troubles; joints stay where they are."""
    joints = SimpleNamespace(
        count=5, angles=lambda: np.zeros(5), speeds=lambda: np.zeros(5), loads=lambda: np.zeros(5), steer=lambda joint, goal: None
    )
    trouble = set()
    bus = driver()
    wire = Beside(bus_of(joints, trouble))
    bus.configure(wire, IDS)
    return bus, wire, trouble


@pytest.mark.parametrize(("bus_of", "driver"), [(FeetechBus, Feetech), (DynamixelBus, Dynamixel)])
def test_health_is_torque_goal_supply_and_case(bus_of, driver):
    bus, wire, _ = servos(bus_of, driver)
    counts = np.array([2048, 1500, 3000, 0, 4095])
    bus.write_goals(wire, IDS, counts)
    assert [bus.health(wire, servo).goal for servo in IDS] == counts.tolist() and not bus.health(wire, 2).holds
    bus.torque(wire, IDS, True)
    health = bus.health(wire, 2)
    assert health.holds and health.voltage == pytest.approx(7.4 if driver is Feetech else 12.0) and health.temperature_degc == 30.0


@pytest.mark.parametrize(
    ("bus_of", "driver", "heads"), [(FeetechBus, Feetech, (4, sts.SYNC_WRITE)), (DynamixelBus, Dynamixel, (7, dynamixel.SYNC_WRITE))]
)
def test_an_old_goal_never_makes_an_arm_jump(built, composed, monkeypatch, bus_of, driver, heads):
    """The frame with the goals is lost; those of the program before would be 60 degrees away."""
    bus, wire, _ = servos(bus_of, driver)
    steered = []
    for servo in wire.device._servos.values():
        servo._motor._joints.steer = lambda joint, goal: steered.append((joint, goal))
    bus.write_goals(wire, IDS, np.full(5, 2048 + 700))
    answer, lost = wire.device.answer, [True]
    wire.device.answer = lambda data: b"" if lost[0] and data[heads[0]] == heads[1] else answer(data)
    monkeypatch.setitem(BUSES, "feetech", lambda: bus)
    serial = composed("backend=serial", "backend.nose.driver=line", "backend.nose.port=none", "backend.arm.driver=feetech")
    port = instantiate(serial.backend.arm, port="/dev/null", tracking_error_s=0.2)
    flat = replace(built("arm"), home_rad=(0.0,) * 5, box_low_m=(-9.0,) * 3, box_high_m=(9.0,) * 3)
    arm = port.live(flat, built("safety"), Mailbox(9), Stepped())
    with pytest.raises(NoAnswer, match="servo 1 was given the goal 2048, but has 2748"):
        arm.configure(wire)
    assert steered == [] and not bus.health(wire, 1).holds
    lost[0] = False
    arm.configure(wire)
    assert bus.health(wire, 5).holds and all(goal == 0.0 for _, goal in steered)


def test_no_number_from_an_scd30_is_counted(co2, monkeypatch):
    nose, wire, clock, box = co2("scd30", 2.0)
    nose.configure(wire)
    monkeypatch.setattr("hardware.drivers.noses.scd30.modbus.floats", lambda words: (float("nan"),))
    while clock.t_s < 9.0:
        nose.poll(wire)
        clock.t_s += 0.1
        wire.device.tick(clock.t_s)
    assert nose.counts()["not a number"] >= 3 and not box.gas


def heated(wire, trouble):
    trouble.add("hot")
    for tick in range(1, 151):
        wire.device.tick(0.02 * tick)


both = pytest.mark.parametrize(
    ("bus_of", "driver", "said"),
    [(FeetechBus, Feetech, "servo 2 reports overheating"), (DynamixelBus, Dynamixel, "servo 2 .*hardware error")],
)


@both
def test_a_servo_that_complains_is_heard_and_not_taken_for_one_that_holds(bus_of, driver, said):
    bus, wire, trouble = servos(bus_of, driver)
    bus.torque(wire, IDS, True)
    assert bus.read_state(wire, IDS).fault is None
    heated(wire, trouble)
    assert re.match(said, bus.read_state(wire, IDS).fault)
    with pytest.raises(NoAnswer, match=said):
        bus.torque(wire, IDS, True)
    bus.torque(wire, IDS, False)  # it may always let go


def test_servos_that_feel_no_load_are_refused():
    bus, wire, _ = servos(DynamixelBus, Dynamixel)
    wire.device._servos[3]._memory[CURRENT_LIMIT] = 0
    with pytest.raises(OioError, match="servo 3 measures no current"):
        bus.configure(wire, IDS)


@pytest.mark.parametrize(("bus_of", "driver"), [(FeetechBus, Feetech), (DynamixelBus, Dynamixel)])
def test_an_answer_that_was_lost_is_asked_for_again(bus_of, driver):
    bus, wire, _ = servos(bus_of, driver)
    answer, lost = wire.device.answer, [2]

    def losing(data):
        lost[0] -= 1
        return b"" if lost[0] >= 0 else answer(data)

    wire.device.answer = losing
    assert bus.ping(wire, 4) is not None
    lost[0] = 3
    assert bus.ping(wire, 4) is None
