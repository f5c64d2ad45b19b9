"""`python -m hardware.joints WORDS`: what an arm that another program commands says of its joints, without leading it anywhere.

The words are those of the run: arm, dof and backend.arm; for instance

  python -m hardware.joints arm=ur5e dof=6 backend.arm.driver=python backend.arm.port=my_ur:Arm

An arm of your own is found with --config-dir FOLDER, as FOLDER/arm/NAME.yaml. The arm is connected, read for three seconds as fast as a run
would, and let go; it is led nowhere. Compare the angles with what its own panel says, and the place of the nose with a ruler. (LeRobot's
own connecting lets go of the joints for a moment, and holds them then.)
"""

import sys
import threading
import time
from collections.abc import Callable

from oio.core import startup
from oio.core.standard_output import ended

startup.handle_signals(__name__)

import hydra
import numpy as np
from hydra.utils import instantiate
from rich.table import Table

from hardware.drivers.arm_port import ADVICE, PORTS, ArmPort
from hardware.drivers.arms.jitter import Jitter
from hardware.drivers.arms.joint_reading import JointReading
from hardware.drivers.robots.robot_arm import TURN
from hardware.drivers.robots.watched_robot import WatchedRobot
from hardware.transport.clock import Clock
from hardware.transport.port import NoAnswer, Unplugged
from oio.cli import terminal
from oio.cli.plugins import own_places, search_path
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
    words, places = own_places(arguments)
    with hydra.initialize_config_dir(str(CONF), version_base="1.3"):
        cfg = hydra.compose("config", [*NO_NOSE, *words, *search_path(places)])
    port: ArmPort = instantiate(cfg.backend.arm, _convert_="all")
    if port.driver not in PORTS:
        raise BadInput(
            f"backend.arm.driver={port.driver} was given, but it can be {', '.join(PORTS)}; of servos hardware.home says as much."
        )
    clock = Clock(1.0)
    arm: Arm = unlocked(instantiate(cfg.arm, _convert_="all"))
    robot = WatchedRobot(port.robot(arm, clock), clock)
    told: list[tuple[str, list[JointReading], Jitter]] = []

    def talk() -> None:
        try:
            robot.connect()
            told.append((robot.describe(), *read_for(robot, port.period_s, clock)))
        finally:
            robot.close()

    try:
        in_time(talk, robot, cfg.backend.timeouts.connect_s)
    except (NoAnswer, Unplugged) as error:
        raise OioError(f"backend.arm.port={port.port} does not answer: {error}.") from error
    except TimeoutError as error:
        raise OioError(f"backend.arm.driver={port.driver} at backend.arm.port={port.port} hangs: {error}. {ADVICE[port.driver]}") from None
    show(arm, *told[0])


def in_time(talk: Callable[[], None], robot: WatchedRobot, limit_s: float) -> None:
    """Call `talk` in a thread of its own, for code of others has no time-out. Raises what it raises, and TimeoutError for a call into the
    robot that does not return within `limit_s`."""
    failed: list[BaseException] = []

    def caught() -> None:
        try:
            talk()
        except BaseException as error:  # an exception in a thread is not reported by itself
            failed.append(error)

    thread = threading.Thread(target=caught, daemon=True)
    thread.start()
    while thread.is_alive():
        interrupt.check()
        if robot.call_s > limit_s:
            raise TimeoutError(f"a call has not returned for {limit_s:g} s")
        thread.join(0.05)
    if failed:
        raise failed[0]


def read_for(robot: WatchedRobot, period_s: float, clock: Clock) -> tuple[list[JointReading], Jitter]:
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
    if np.max(np.abs(q[-1])) > TURN:
        console.print(
            f"It says {np.round(q[-1], 2).tolist()}, more than a turn as radians; if those are degrees, give radians.", markup=False
        )


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
