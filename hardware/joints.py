"""`python -m hardware.joints WORDS`: what an arm that another program commands says of its joints, without leading it anywhere.

The words are those of the run: arm, dof and backend.arm; for instance

  python -m hardware.joints arm=ur5e dof=6 backend.arm.driver=python backend.arm.port=my_ur:Arm

It is connected, read for three seconds as fast as a run would, and let go; it is led nowhere. Compare the angles with what its own panel
says, and the place of the nose with a ruler. (LeRobot's own connecting lets go of the joints for a moment, and holds them then.)
"""

import sys
import time

from oio.core import startup
from oio.core.standard_output import ended

startup.handle_signals(__name__)

import hydra
import numpy as np
from hydra.utils import instantiate
from rich.table import Table

from hardware.drivers.arm_port import PORTS, ArmPort
from hardware.drivers.arms.jitter import Jitter
from hardware.drivers.arms.joint_reading import JointReading
from hardware.drivers.robots.robot import Robot
from hardware.transport.clock import Clock
from hardware.transport.port import NoAnswer, Unplugged
from oio.cli import terminal
from oio.cli.tool_args import run_tool
from oio.core import interrupt
from oio.core.errors import BadInput, OioError
from oio.core.folders import CONF
from oio.core.records import Array
from oio.gas.source import unlocked
from oio.kinematics.arm import Arm

FOR_S = 3.0  # of reading [host s]
NO_NOSE = ("backend=serial", "sensor=ndir", "backend.nose.driver=scd30", "backend.nose.port=none")


def main(arguments: list[str]) -> None:
    """Read the joints, and print what they say."""
    with hydra.initialize_config_dir(str(CONF), version_base="1.3"):
        cfg = hydra.compose("config", [*NO_NOSE, *arguments])
    port: ArmPort = instantiate(cfg.backend.arm, _convert_="all")
    if port.driver not in PORTS:
        raise BadInput(
            f"backend.arm.driver={port.driver} was given, but it can be {', '.join(PORTS)}; of servos hardware.home says as much."
        )
    clock = Clock(1.0)
    arm: Arm = unlocked(instantiate(cfg.arm, _convert_="all"))
    robot = port.robot(arm, clock)
    try:
        robot.connect()
        identity, (readings, rhythm) = robot.describe(), read_for(robot, port.period_s, clock)
    except (NoAnswer, Unplugged) as error:
        raise OioError(f"backend.arm.port={port.port} does not answer: {error}.") from error
    finally:
        robot.close()
    show(arm, identity, readings, rhythm)


def read_for(robot: Robot, period_s: float, clock: Clock) -> tuple[list[JointReading], Jitter]:
    """Return the readings of `FOR_S` seconds, and how evenly they came."""
    readings, rhythm, end_s = list[JointReading](), Jitter(), time.monotonic() + FOR_S
    while time.monotonic() < end_s:
        interrupt.check()
        readings.append(robot.read())
        rhythm.beat(clock.now_ns())
        time.sleep(period_s)
    return readings, rhythm


def show(arm: Arm, identity: str, readings: list[JointReading], rhythm: Jitter) -> None:
    """Print joints, their spread and the place of the nose."""
    q = np.array([reading.q for reading in readings])  # (k, n)
    per_unit = np.where(np.array(arm.units) == "m", 1e3, np.degrees(1.0))
    console, table = terminal.console(soft_wrap=True), Table("joint", "last", "spread", "load", "limits")
    for name, *cells in zip(arm.all_names, *_columns(arm, q * per_unit, readings[-1].load, per_unit), strict=True):
        table.add_row(name, *cells)
    console.print(f"{identity}: {len(q)} readings, {rhythm}", markup=False)
    console.print(table)
    where = "where it may stand" if arm.is_allowed(q[-1]) else "where it may NOT stand: it would not be led"
    console.print(f"The nose is at {np.round(arm.nose(q[-1]), 3).tolist()} m, {where}.", markup=False)


def _columns(arm: Arm, q: Array, load: Array, per_unit: Array) -> tuple[list[str], ...]:
    """Cells (n,) of the columns: last position, standard deviation, load, limits; degrees, or mm of a slide."""
    low, high = arm.low_rad * per_unit, arm.high_rad * per_unit
    return (
        [f"{x:.2f}" for x in q[-1]],
        [f"{x:.3f}" for x in np.std(q, axis=0)],
        ["-" if np.isnan(x) else f"{100 * x:.0f} %" for x in load],
        [f"{a:.0f} to {b:.0f}" for a, b in zip(low, high, strict=True)],
    )


if __name__ == "__main__":
    sys.exit(ended(lambda: run_tool(main, (__doc__ or "").strip())))
