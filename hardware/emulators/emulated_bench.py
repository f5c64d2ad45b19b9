"""Emulated bench: plant, devices and ports put together."""

import contextlib
import os
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hardware.backends.mujoco_sim import MujocoSim
from hardware.emulators import scd30, scd41
from hardware.emulators.device import Device, Electronics, Trouble
from hardware.emulators.dynamixel import Dynamixel
from hardware.emulators.emulated_port import EmulatedPort, EventQueue
from hardware.emulators.feetech import Feetech
from hardware.emulators.line import HOLD_S, LineNose, Valve
from hardware.emulators.loop import Loop
from hardware.emulators.options import EmulatorOptions
from hardware.emulators.pty import PseudoTerminal
from hardware.emulators.realtime_plant import RealtimePlant
from hardware.simulation.plant import Plant
from oio.core.errors import BadInput

BUSES: dict[str, type[Feetech] | type[Dynamixel]] = {"feetech": Feetech, "dynamixel": Dynamixel}


@dataclass(frozen=True)
class EmulatedBench:
    """Emulated bench whose loop is not running yet."""

    loop: Loop
    plant: Plant
    ports: dict[str, Path]  # device name (nose, arm, valve) to port


@contextlib.contextmanager
def emulate_bench(options: EmulatorOptions, sim: MujocoSim) -> Iterator[EmulatedBench]:
    """Create the bench; its ports exist until the end of the context. Raises BadInput for options that do not fit together."""
    options.refuse_another_sensor(sim)
    schedule = options.schedule()
    _warm_up_kernels(sim)
    with sim.plant() as plant, _folder(options.out) as folder:
        realtime, agenda = RealtimePlant(plant, sim.arm, options.speed), EventQueue()
        served = {
            name: EmulatedPort(
                device, PseudoTerminal(folder / name), trouble, agenda, options.speed, sim.seeds.rng("disturbance", f"wire {name}")
            )
            for name, device, trouble in _devices(options, sim, realtime)
        }
        with _plugged([each.port for each in served.values()]):
            yield EmulatedBench(Loop(realtime, served, agenda, schedule), plant, {name: each.port.link for name, each in served.items()})


def _warm_up_kernels(sim: MujocoSim) -> None:
    """Warm-up of compiled code, whose first use takes seconds in which no device would answer; uses an air of its own."""
    air = sim.air.open(np.random.default_rng(0), np.random.default_rng(0))
    air.present(np.zeros(3), sim.emission_ml_s)
    air.step(sim.joint_period_s)
    air.ppm(np.ones(3))


def _devices(options: EmulatorOptions, sim: MujocoSim, realtime: RealtimePlant) -> Iterator[tuple[str, Device, set[str]]]:
    trouble = set[str]()
    yield "nose", _nose(options.nose, sim, realtime, trouble), trouble
    if options.arm != "none":
        trouble = set()
        yield "arm", Feetech(realtime, trouble, gripper=True) if options.gripper else BUSES[options.arm](realtime, trouble), trouble
    if options.valve != "none":
        trouble = set()
        hold_s = HOLD_S * max(1.0, options.speed / 4.0)  # the heartbeat of its host has a period of 1 s of the host's time
        yield "valve", Valve(realtime.present, trouble, hold_s), trouble


def _nose(driver: str, sim: MujocoSim, realtime: RealtimePlant, trouble: Trouble) -> Device:
    sensor = sim.sensor
    if driver == "line":
        bits: int = getattr(sensor, "adc_bits")  # noqa: B009  # not in the protocol; checked by refuse_another_sensor
        return LineNose(Electronics(realtime.raw, (1 << bits) - 1, trouble), sensor.elements, bits, trouble)
    update_s: float = getattr(sensor, "dynamics").update_s  # noqa: B009
    if driver == "scd30":
        return scd30.Scd30(Electronics(realtime.raw, scd30.FULL_PPM, trouble), update_s, trouble)
    return scd41.SensorBridge(scd41.Scd41(Electronics(realtime.raw, scd41.FULL_PPM, trouble), update_s), trouble)


@contextlib.contextmanager
def _folder(given: str | None) -> Iterator[Path]:
    if given is None:
        with tempfile.TemporaryDirectory(prefix="oio-emulate-") as made:  # created with access for this user only
            yield Path(made)
        return
    folder = Path(given).expanduser().absolute()
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    except OSError as error:
        raise BadInput(f"out={given} was given, but it is no folder: {error.strerror}. Type e.g. out=/tmp/bench.") from None
    yield folder


@contextlib.contextmanager
def _plugged(ports: list[PseudoTerminal]) -> Iterator[None]:
    for port in ports:
        _refuse_taken(port.link)
    try:
        for port in ports:
            port.plug()
        yield
    finally:
        for port in ports:
            port.unplug()


def _refuse_taken(link: Path) -> None:
    """Refuse a link in use; a dangling link, left by an emulator that was killed, is removed."""
    if link.is_symlink() and not link.exists():
        link.unlink()
    if os.path.lexists(link):
        raise BadInput(f"out={link.parent} was given, but {link} is there already. End the other emulator, or type another out=.")
