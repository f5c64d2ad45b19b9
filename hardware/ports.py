"""`python -m hardware.ports`: list the serial ports, identify the devices on them, and print the configuration to paste.

Ports that the system does not list (emulators) are asked if they are given as words: python -m hardware.ports out/nose out/arm
"""

import sys
from collections.abc import Iterator
from pathlib import Path

from oio.core import startup
from oio.core.standard_output import ended

startup.handle_signals(__name__)

from rich.markup import escape
from serial.tools import list_ports

from hardware.drivers.noses.line import Line, Sentence
from hardware.drivers.noses.reading_filter import ReadingFilter
from hardware.drivers.noses.scd30 import Scd30
from hardware.drivers.noses.scd41 import Scd41
from hardware.drivers.servos.buses import BUSES
from hardware.transport.clock import Clock
from hardware.transport.discovery import port_name
from hardware.transport.driver import SerialDriver
from hardware.transport.mailbox import Mailbox
from hardware.transport.port import NoAnswer, Unplugged, open_port
from oio.cli import terminal
from oio.cli.tool_args import run_tool
from oio.core import interrupt
from oio.core.errors import BadInput

IDS = range(1, 8)  # servo ids to ping


def main(arguments: list[str]) -> None:
    """Identify the device on every port."""
    for path in arguments:
        if not Path(path).exists():
            raise BadInput(f"{path} was given, but there is no such port. Type e.g. python -m hardware.ports /dev/ttyUSB0.")
    console = terminal.console(soft_wrap=True)
    infos = {info.device: port_name(info) for info in list_ports.comports()} | {path: "given" for path in arguments}
    if not infos:
        console.print("Nothing is plugged in that the system lists. A port can be given: python -m hardware.ports /dev/ttyUSB0")
        return
    for path, name in infos.items():
        with console.status(f"asking {path} ..."):
            answers = asked_all(path, name)
        console.print(f"[bold]{escape(path)}[/bold] ({escape(name)}): {escape(answers[0][0]) if answers else 'says nothing that is known'}")
        for _, line in answers:
            console.print(f"    {line}", markup=False)


def asked_all(path: str, name: str) -> list[tuple[str, str]]:
    """Return the devices that answer on a port, each with its configuration line; stops at the first driver that is answered."""
    *quick, slow = noses()
    for driver in quick:
        if identity := _answer(path, driver.baud, driver):
            return [(identity, _line("nose", driver.name, path, name))]
    for kind in BUSES:
        if identity := _servos(path, kind):
            return [(identity, _line("arm", BUSES[kind]().name, path, name))]
    if identity := _answer(path, slow.baud, slow):
        return [(identity, _line("nose", slow.name, path, name)), (identity, _line("valve", slow.name, path, name))]
    return []


def noses() -> Iterator[SerialDriver]:
    """Yield one driver of each kind, for identification only; the one that waits for a booting device last."""
    intake, clock = ReadingFilter(Mailbox(1), 2, 1.0, 2), Clock(1.0)
    yield Scd30(intake, clock, 1.0)
    yield Scd41(intake, clock, 1.0)
    yield Line(intake, clock, Sentence("NOSE", ("ms", "active", "adcA", "adcB"), "AB", 0), 1.0)


def _answer(path: str, baud: int, driver: SerialDriver) -> str | None:
    interrupt.check()
    try:
        wire = open_port(path, baud, "port")
    except (Unplugged, BadInput):
        return None
    try:
        return driver.identify(wire)
    except Unplugged:
        return None
    finally:
        wire.close()


def _servos(path: str, kind: str) -> str | None:
    interrupt.check()
    bus = BUSES[kind]()
    try:
        wire = open_port(path, bus.baud, "port")
    except (Unplugged, BadInput):
        return None
    try:
        models = {servo: bus.ping(wire, servo) for servo in IDS}
    except (Unplugged, NoAnswer):
        return None
    finally:
        wire.close()
    found = [f"{servo} {model}" for servo, model in models.items() if model]
    return f"servos {', '.join(found)}" if found else None


def _line(key: str, driver: str, path: str, name: str) -> str:
    port = name if name.startswith("usb:") else path
    return f"backend.{key}.driver={driver} backend.{key}.port={port}"


if __name__ == "__main__":
    sys.exit(ended(lambda: run_tool(main, (__doc__ or "").strip())))
