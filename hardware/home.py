"""`python -m hardware.home port=/dev/ttyUSB0`: joint calibration (homing) of a servo arm, by moving its joints by hand.

Every joint is turned by hand to its LOW end and then to its HIGH end, whose angles are in the MJCF; the program prints which way each is.
From the two ends follow the zero and the direction of its counts. Torque is disabled for this: hold the arm, and bring it to about its
home first, because the printed directions are those from there. A joint that turns farther than in the MJCF, or without end, is turned to
tape marks at the MJCF's two angles. Implausible sweeps are refused, and nothing is written. At the end the position of the nose is
printed: compare it with a ruler, because a joint whose LOW and HIGH were swapped in every round fits, too, and would move mirrored.

  driver=feetech     or dynamixel
  port=              a path, or usb:VENDOR:PRODUCT[:SERIAL]
  arm=so101          whose MJCF has the limits; one of your own is FOLDER/arm/NAME.yaml of --config-dir FOLDER
  repeats=2          sweeps per joint; their spread enters the uncertainty
  out=homing.json    the file; then type arm.homing=homing.json
"""

import sys
from collections.abc import Sequence
from pathlib import Path

from oio.core import startup
from oio.core.standard_output import ended

startup.handle_signals(__name__)

import hydra
from hydra.utils import instantiate

from hardware.drivers.servos.bus import Bus
from hardware.drivers.servos.buses import BUSES
from hardware.drivers.servos.homing_procedure import run_procedure
from hardware.transport.discovery import resolve_port
from hardware.transport.port import NoAnswer, Unplugged, Wire, open_port
from oio.cli import terminal
from oio.cli.plugins import own_places, search_path
from oio.cli.tool_args import key_values, run_tool, whole_number
from oio.core.errors import BadInput, OioError
from oio.core.folders import CONF
from oio.gas.source import unlocked as whole_arm
from oio.kinematics.arm import Arm

KEYS = {"driver": "feetech", "port": "", "arm": "so101", "repeats": "2", "out": "homing.json"}


def main(arguments: list[str]) -> None:
    """Guide a user through the homing procedure."""
    words, places = own_places(arguments)
    given, plain = key_values(words, KEYS, "python -m hardware.home")
    if plain:
        raise BadInput(f"{plain[0]} was given, but only KEY=VALUE is taken: {', '.join(KEYS)}. Type e.g. port=/dev/ttyUSB0.")
    if given["driver"] not in BUSES:
        raise BadInput(f"driver={given['driver']} was given, but it can be {', '.join(BUSES)}. Type driver=feetech.")
    if not given["port"]:
        raise BadInput("no port was given. Type port=/dev/ttyUSB0; `python -m hardware.ports` finds it.")
    arm, repeats, bus = described(given["arm"], places), whole_number("repeats", given["repeats"], 1, 10), BUSES[given["driver"]]()
    wire = _open_wire(given["port"], bus)
    try:
        run_procedure(terminal.console(soft_wrap=True), bus, wire, arm, repeats, Path(given["out"]).expanduser())
    except (Unplugged, NoAnswer) as error:
        raise OioError(
            f"the servos at port={given['port']} do not answer any more ({error}). Check cable and power; nothing was written."
        ) from None
    finally:
        wire.close()


def described(name: str, places: Sequence[str]) -> Arm:
    """Load the whole arm of conf/arm, or of another of the places. Raises what Hydra raises for one that does not exist."""
    with hydra.initialize_config_dir(str(CONF), version_base="1.3"):
        cfg = hydra.compose("config", [f"arm={name}", "dof=1", *search_path(places)])
    return whole_arm(instantiate(cfg.arm))


def _open_wire(port: str, bus: Bus) -> Wire:
    try:
        return open_port(resolve_port(port, "port", bus.baud, lambda wire: bus.ping(wire, 1)), bus.baud, "port")
    except Unplugged as error:
        raise BadInput(
            f"port={port} was given, but it cannot be opened: {error}. `python -m hardware.ports` lists what is there."
        ) from None


if __name__ == "__main__":
    sys.exit(ended(lambda: run_tool(main, (__doc__ or "").strip())))
