"""World of a real bench: a nose and an arm over serial ports, or the emulators of `python -m hardware.emulate`."""

import contextlib
import math
import os
import sys
from collections.abc import Iterator
from typing import Annotated, Any, ClassVar

from hardware.backends.live_world import LiveDevices, LiveWorld
from hardware.drivers.arm_port import ArmPort
from hardware.drivers.arms.fixed_mount import FixedMount
from hardware.drivers.noses.port import NosePort
from hardware.drivers.valves.port import ValvePort
from hardware.transport.clock import Clock
from hardware.transport.device import Device
from hardware.transport.driver import Timeouts
from hardware.transport.mailbox import Mailbox
from hardware.transport.opener import SerialOpener
from oio.core import interrupt
from oio.core.errors import BadInput
from oio.core.interfaces import Sensor
from oio.core.settings import Within, settings
from oio.gas.source import Source
from oio.kinematics.arm import Arm
from oio.motion.guard import SafetyLimits

SWITCH_S = 1e-3  # of the interpreter, between threads: 5 ms, its default, keep a sample waiting; 0.2 ms let the arm cut a belief in pieces


@settings
class SerialPort:
    """Configuration of a bench; frozen, `open()` makes it live."""

    real_time: ClassVar[bool] = True
    kinematics: Arm
    sensor: Sensor
    beacon: Source
    source: Source  # its position, if measured, is logged for scoring
    safety: SafetyLimits
    timeouts: Timeouts
    nose: NosePort
    arm: ArmPort
    valve: ValvePort
    speed: Annotated[float, Within(0.1, 100)]  # world seconds per host second: 1, except for emulators
    queue: Annotated[int, Within(10, 10_000_000)]  # largest number of samples waiting for the pipeline
    reorder_s: Annotated[float, Within(0, 1)]  # delay of joint states, waiting for older gas samples

    @contextlib.contextmanager
    def open(self) -> Iterator[LiveWorld]:
        """Find the ports, configure the devices and move the arm home. Raises BadInput or OioError naming a device that does not answer."""
        self._refuse_emulator_settings()
        clock, mailbox = Clock(self.speed), Mailbox(self.queue)
        sniffer = self.nose.live(self.sensor, clock, mailbox)
        nose = Device(SerialOpener(self.nose.port, sniffer), sniffer, mailbox, clock, self.timeouts)
        led = self.arm.live(self.kinematics, self.safety, mailbox, clock)
        arm = None if led is None else Device(self.arm.opener(led), led, mailbox, clock, self.timeouts)
        devices: list[Device[Any]] = [nose] if arm is None else [nose, arm]
        sys.setswitchinterval(SWITCH_S)
        with self.valve.open(self.timeouts) as valve:
            try:
                for device in devices:
                    _start(device)
                mover = led or FixedMount(self.kinematics, self.arm.period_s)
                places_m = {"beacon": self.beacon.position, "source": self.source.position}
                bench = LiveWorld(LiveDevices(nose, arm, mover, valve), clock, mailbox, self.kinematics, places_m, self.reorder_s)
                if led is not None and led.distance_from_home_rad > math.radians(self.arm.hands_off_deg):
                    _hands_off(bench, self.arm.hands_off_s)
                bench.go_home(self.arm.home_s)
                yield bench
            finally:
                for device in reversed(devices):  # first the arm, last the valve
                    device.stop()

    def _refuse_emulator_settings(self) -> None:
        """Refuse, for real parts, what only emulators accept: another speed, faster sampling, an arm without homing."""
        nose, arm = None if os.path.realpath(self.nose.port).startswith("/dev/pts/") else self.nose.port, self.arm.real_port
        if self.speed != 1.0 and (nose or (arm and not self.arm.may_hurry)):
            raise BadInput(f"backend.speed={self.speed:g} was given, but {nose or arm} is real, and so is its time. Type backend.speed=1.")
        if nose and self.sensor.sample_s < self.nose.least_s:
            raise BadInput(
                f"sensor={self.sensor.name} is to be sampled every {self.sensor.sample_s:g} s, but backend.nose.driver={self.nose.driver} "
                f"gives a value every {self.nose.least_s:g} s. Type profile=datasheet stage.navigate.max_s=600."
            )
        if arm and self.kinematics.homed is None and not self.arm.knows_its_zeros:
            raise BadInput(
                f"backend.arm.port={arm} was given without arm.homing, but the zeros of its servos are not known without it. Type "
                f"python -m hardware.home port={arm} out=homing.json first, then arm.homing=homing.json."
            )


def _hands_off(bench: LiveWorld, for_s: float) -> None:
    print(f"oio: the arm holds itself. Hands off: it goes home in {for_s:g} s.", file=sys.stderr, flush=True)  # noqa: T201
    for _ in bench.samples(for_s):
        interrupt.check()


def _start(device: Device[Any]) -> None:
    device.start()
    while not device.ready.wait(0.1):
        interrupt.check()
        device.check()
    device.check()
