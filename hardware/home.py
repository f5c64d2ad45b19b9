"""`python -m hardware.home port=/dev/ttyUSB0`: which count of a servo is which angle, found with the arm in your hands.

Every joint is turned by hand to both of its ends, whose angles the MJCF knows. Torque is switched off for it: hold the arm.

  driver=feetech     or dynamixel
  port=              a path, or usb:VENDOR:PRODUCT[:SERIAL]
  arm=so101          whose MJCF has the limits
  sign=              +1 or -1 per joint, e.g. sign=1,1,-1,1,1: counts rise with the MJCF's angle, or fall; default +1
  repeats=2          so often each joint is turned; the spread says how well
  out=homing.json    the file; then type arm.homing=homing.json
"""

import contextlib
import math
import select
import sys
from collections.abc import Callable
from pathlib import Path

from oio import launch

launch.begin(__name__)

import hydra
import numpy as np
from hydra.utils import instantiate
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from hardware.asked import ended, whole, words
from hardware.links.find import found
from hardware.links.port import NoAnswer, Unplugged, Wire, opened
from hardware.servos import BUSES
from hardware.servos.bus import Bus
from hardware.turned import Turned, joined
from oio import stopping
from oio.arm import Arm
from oio.conf import CONF
from oio.errors import BadInput, OioError
from oio.places import whole as whole_arm

KEYS = {"driver": "feetech", "port": "", "arm": "so101", "sign": "", "repeats": "2", "out": "homing.json"}
LOOK_S = 0.02
Done = Callable[[float], bool]


def main(arguments: list[str]) -> None:
    """Walk a person through it."""
    given, plain = words(arguments, KEYS, "python -m hardware.home")
    if plain:
        raise BadInput(f"{plain[0]} was given, but only KEY=VALUE is taken: {', '.join(KEYS)}. Type e.g. port=/dev/ttyUSB0.")
    if given["driver"] not in BUSES:
        raise BadInput(f"driver={given['driver']} was given, but it can be {', '.join(BUSES)}. Type driver=feetech.")
    if not given["port"]:
        raise BadInput("no port was given. Type port=/dev/ttyUSB0; `python -m hardware.ports` finds it.")
    arm, repeats, bus = described(given["arm"]), whole("repeats", given["repeats"], 1, 10), BUSES[given["driver"]]()
    signs = signs_of(given["sign"], len(arm.all_names))
    wire = _wire(given["port"], bus)
    try:
        _walk(Console(soft_wrap=True), bus, wire, arm, signs, repeats, Path(given["out"]).expanduser())
    except (Unplugged, NoAnswer) as error:
        raise OioError(
            f"the servos at port={given['port']} do not answer any more ({error}). Check cable and power; nothing was written."
        ) from None
    finally:
        wire.close()


def described(name: str) -> Arm:
    """The whole arm of conf/arm. Raises BadInput."""
    if not (CONF / "arm" / f"{name}.yaml").is_file():
        there = ", ".join(sorted(path.stem for path in (CONF / "arm").glob("*.yaml")))
        raise BadInput(f"arm={name} was given, but it can be {there}. Type arm=so101.")
    with hydra.initialize_config_dir(str(CONF), version_base="1.3"):
        cfg = hydra.compose("config", [f"arm={name}", "dof=1"])
    return whole_arm(instantiate(cfg.arm))


def signs_of(text: str, joints: int) -> tuple[int, ...]:
    """+1 or -1 per joint. Raises BadInput."""
    signs = text.split(",") if text else ["1"] * joints
    if len(signs) != joints or not set(signs) <= {"1", "+1", "-1"}:
        raise BadInput(f"sign={text} was given, but {joints} values of 1 or -1 are needed. Type sign={','.join(['1'] * joints)}.")
    return tuple(int(sign) for sign in signs)


def _wire(port: str, bus: Bus) -> Wire:
    try:
        return opened(found(port, "port", bus.baud, lambda wire: bus.ping(wire, 1)), bus.baud, "port")
    except Unplugged as error:
        raise BadInput(
            f"port={port} was given, but it cannot be opened: {error}. `python -m hardware.ports` lists what is there."
        ) from None


def _walk(console: Console, bus: Bus, wire: Wire, arm: Arm, signs: tuple[int, ...], repeats: int, out: Path) -> None:
    ids = list(range(1, len(arm.all_names) + 1))
    missing = [servo for servo in ids if bus.ping(wire, servo) is None]
    if missing:
        raise OioError(
            f"servo {missing[0]} of {len(ids)} does not answer at {bus.baud} baud. Check power, cable, and that ids are 1 to {len(ids)}."
        )
    bus.begin(wire, ids)
    console.print(f"Hold the arm: when you press Enter its {len(ids)} servos let go.")
    _until_enter(_entered, lambda: None)
    bus.torque(wire, ids, False)
    rounds = [[_turned(console, bus, wire, ids, i, arm, k, repeats) for i in range(len(ids))] for k in range(repeats)]
    homing = joined(rounds, arm, signs, bus.counts_per_turn)
    homing.write(out)
    console.print(_table(rounds[-1], homing.zero_counts, homing.u_deg, arm, bus.counts_per_turn))
    console.print(f"Written to {out}. Type: arm.homing={out}", markup=False)


def _turned(console: Console, bus: Bus, wire: Wire, ids: list[int], i: int, arm: Arm, k: int, repeats: int) -> Turned:
    low, high = math.degrees(arm.low_rad[i]), math.degrees(arm.high_rad[i])
    name = arm.all_names[i]
    console.print(
        f"[bold]{escape(name)}[/bold] ({i + 1} of {len(ids)}, round {k + 1} of {repeats}): turn it by hand to one end, then to the other "
        f"({low:.0f} to {high:.0f} degrees), then press Enter."
    )
    turned = Turned(name, bus.counts_per_turn)
    _until_enter(_entered, lambda: _look(bus, wire, ids, i, turned))
    return turned


def _look(bus: Bus, wire: Wire, ids: list[int], i: int, turned: Turned) -> None:
    with contextlib.suppress(NoAnswer):  # the next look will do
        turned.add(int(bus.feel(wire, ids).counts[i]))


def _until_enter(entered: Done, look: Callable[[], None]) -> None:
    while not entered(LOOK_S):
        stopping.check()
        look()


def _entered(wait_s: float) -> bool:
    """Whether a line was typed. Raises OioError at the end of input."""
    if not select.select([sys.stdin], [], [], wait_s)[0]:
        return False
    if not sys.stdin.readline():
        raise OioError("standard input has ended before the arm was homed; nothing was written.")
    return True


def _table(last: list[Turned], zeros: tuple[int, ...], u_deg: tuple[float, ...], arm: Arm, per_turn: int) -> Table:
    table = Table("joint", "turned [deg]", "MJCF [deg]", "zero [counts]", "+- [deg]", title="homing", title_justify="left")
    span = np.degrees(arm.high_rad - arm.low_rad)
    for turned, zero, u, mjcf in zip(last, zeros, u_deg, span, strict=True):
        table.add_row(escape(turned.name), f"{360.0 * turned.span / per_turn:.1f}", f"{mjcf:.1f}", str(zero), f"{u:.2f}")
    return table


if __name__ == "__main__":
    ended(main, (__doc__ or "").strip())
