"""The homing procedure in the terminal: joints swept by hand to their named ends, a table, a comparison with a ruler."""

import contextlib
import select
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from hardware.drivers.servos.bus import Bus, Positions
from hardware.drivers.servos.end_directions import end_directions
from hardware.drivers.servos.joint_calibration import JointSweep, ends_deg, homing_from_sweeps
from hardware.transport.port import NoAnswer, Wire
from oio.core import interrupt
from oio.core.errors import OioError
from oio.core.records import Array
from oio.kinematics.arm import Arm
from oio.kinematics.homing import Homing

LOOK_S = 0.02


TRIES = 10  # attempts to read positions before NoAnswer


AGREES_M = 0.03  # accuracy of a ruler held by hand


Done = Callable[[float], bool]


def run_procedure(console: Console, bus: Bus, wire: Wire, arm: Arm, repeats: int, out: Path) -> None:
    """Ask for both ends of every joint `repeats` times, show where the nose is, and write the homing file."""
    ids = list(range(1, len(arm.all_names) + 1))
    missing = [servo for servo in ids if bus.ping(wire, servo) is None]
    if missing:
        raise OioError(
            f"servo {missing[0]} of {len(ids)} does not answer at {bus.baud} baud. Check power, cable, and that ids are 1 to {len(ids)}."
        )
    bus.configure(wire, ids)
    console.print(f"Hold the arm: when you press Enter its {len(ids)} servos let go.")
    console.print(
        f"Then bring it to about its home, the nose {_position(arm.nose(arm.home))}: which way a joint's LOW and HIGH are is told from "
        f"there. Other joints may be bent out of the way, but read the words with all of them back at home."
    )
    _until_enter(_entered, lambda: None)
    bus.torque(wire, ids, False)
    rounds = [[_sweep_joint(console, bus, wire, ids, i, arm, k, repeats) for i in range(len(ids))] for k in range(repeats)]
    homing = homing_from_sweeps(rounds, arm, bus.counts_per_turn)
    console.print(_table(rounds[-1], homing, arm))
    _compare_with_ruler(console, bus, wire, ids, arm, homing)
    homing.write(out)
    console.print(f"Written to {out}. Type: arm.homing={out}", markup=False)


def _compare_with_ruler(console: Console, bus: Bus, wire: Wire, ids: list[int], arm: Arm, homing: Homing) -> None:
    """Let the user check the nose position with a ruler: ends swapped in every round are consistent and cannot be detected otherwise."""
    console.print("Compare: bend every joint out of its middle, the nose to the arm's left, hold it so, and press Enter.")
    _until_enter(_entered, lambda: None)
    nose = arm.nose(homing.angles(_read_counts(bus, wire, ids), bus.counts_per_turn))
    console.print(
        f"  The nose should now be {_position(nose)}. Take a ruler: if that is right to {AGREES_M:.2f} m, press Enter. If not, a joint was "
        f"turned to HIGH where LOW was asked for: press Ctrl-C, nothing is written, and home again."
    )
    _until_enter(_entered, lambda: None)


def _position(nose: Array) -> str:
    ahead, left, up = np.round(nose, 2) + 0.0  # avoids -0.00
    return f"{ahead:.2f} m in front of the base's origin, {left:.2f} m to its left, {up:.2f} m above"


def _read_counts(bus: Bus, wire: Wire, ids: list[int]) -> Positions:
    for _ in range(TRIES):
        with contextlib.suppress(NoAnswer):
            return bus.read_state(wire, ids).counts
    raise NoAnswer(f"asked {TRIES} times")


def _sweep_joint(console: Console, bus: Bus, wire: Wire, ids: list[int], i: int, arm: Arm, k: int, repeats: int) -> JointSweep:
    """Record one joint's sweep from LOW to HIGH. Raises OioError at once if these cannot be its ends."""
    name, ends = arm.all_names[i], ends_deg(arm, i)
    sweep = JointSweep(name, bus.counts_per_turn, ends)
    console.print(f"[bold]{escape(name)}[/bold] ({i + 1} of {len(ids)}, round {k + 1} of {repeats}):")
    for end, degrees, direction in zip(("LOW", "HIGH"), ends, end_directions(arm)[i], strict=True):
        console.print(f"  turn it by hand to its {end} end ({degrees:.0f} degrees; from home {direction}), hold it there, and press Enter.")
        _until_enter(_entered, lambda: _add_reading(bus, wire, ids, i, sweep))
        _add_reading(bus, wire, ids, i, sweep)
        sweep.stop()
    _ = sweep.sign  # an implausible sweep is refused now, not after all the others
    return sweep


def _add_reading(bus: Bus, wire: Wire, ids: list[int], i: int, sweep: JointSweep) -> None:
    with contextlib.suppress(NoAnswer):  # the next reading will do
        sweep.add(int(bus.read_state(wire, ids).counts[i]))


def _until_enter(entered: Done, read: Callable[[], None]) -> None:
    while not entered(LOOK_S):
        interrupt.check()
        read()


def _entered(wait_s: float) -> bool:
    """Whether a line was typed within wait_s [s]. Raises OioError at the end of standard input."""
    if not select.select([sys.stdin], [], [], wait_s)[0]:
        return False
    if not sys.stdin.readline():
        raise OioError("standard input has ended before the arm was homed; nothing was written.")
    return True


def _table(last: list[JointSweep], homing: Homing, arm: Arm) -> Table:
    head = "joint", "turned [deg]", "MJCF [deg]", "zero [counts]", "counts", "+- [deg]"
    table = Table(*map(escape, head), title="homing", title_justify="left")
    span = np.degrees(arm.high_rad - arm.low_rad)
    for sweep, zero, sign, u, mjcf in zip(last, homing.zero_counts, homing.sign, homing.u_deg, span, strict=True):
        rise = "rise" if sign > 0 else "fall"
        table.add_row(escape(sweep.name), f"{sweep.span_deg:.1f}", f"{mjcf:.1f}", str(zero), rise, f"{u:.2f}")
    return table
