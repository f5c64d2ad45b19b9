"""Serial port discovery: a path, `usb:VENDOR:PRODUCT[:SERIAL]`, or `ask`, which sends an identification request to every port."""

import os
import re
from collections.abc import Callable

from serial.tools import list_ports

from hardware.transport.port import NoAnswer, Unplugged, Wire, open_port
from oio.core.errors import BadInput

USB = re.compile(r"usb:([0-9A-Fa-f]{4}):([0-9A-Fa-f]{4})(?::(.+))?")
Identify = Callable[[Wire], str | None]


def resolve_port(port: str, key: str, baud: int, identify: Identify) -> str:
    """Return the path of `port`. Raises BadInput, naming `key`, if no port or more than one port matches."""
    usb = USB.fullmatch(port)
    if usb:
        return _exactly_one(port, key, [info.device for info in list_ports.comports() if _matches_usb(info, usb)])
    if port == "ask":
        return _exactly_one(port, key, [info.device for info in list_ports.comports() if _identifies(info.device, key, baud, identify)])
    if not os.path.exists(port):
        raise BadInput(f"{key}={port} was given, but there is no such port. {plugged_in()}")
    return port


def plugged_in() -> str:
    """List the serial ports of the system, as a sentence for error messages."""
    names = [f"{info.device} ({port_name(info)})" for info in list_ports.comports()]
    listing = f"Plugged in: {', '.join(names)}." if names else "Nothing is plugged in that the system lists."
    return f"{listing} `python -m hardware.ports` asks each who it is."


def port_name(info: object) -> str:
    """Return a port's name as a user types it: usb:VENDOR:PRODUCT:SERIAL, or the system's description."""
    vid, pid, number = (getattr(info, name, None) for name in ("vid", "pid", "serial_number"))
    if vid is None or pid is None:
        return str(getattr(info, "description", "unknown"))
    return f"usb:{vid:04X}:{pid:04X}" + (f":{number}" if number else "")


def _matches_usb(info: object, usb: re.Match[str]) -> bool:
    vid, pid, number = usb.groups()
    if getattr(info, "vid", None) is None:
        return False
    same = (int(vid, 16), int(pid, 16)) == (getattr(info, "vid", None), getattr(info, "pid", None))
    return same and number in (None, getattr(info, "serial_number", None))


def _identifies(path: str, key: str, baud: int, identify: Identify) -> bool:
    try:
        wire = open_port(path, baud, key)
    except (BadInput, Unplugged):
        return False  # in use by another program
    try:
        return identify(wire) is not None
    except (Unplugged, NoAnswer):
        return False
    finally:
        wire.close()


def _exactly_one(port: str, key: str, paths: list[str]) -> str:
    if len(paths) == 1:
        return paths[0]
    if paths:
        raise BadInput(f"{key}={port} was given, but {len(paths)} ports fit: {', '.join(paths)}. Type {key}={paths[0]} or another of them.")
    raise BadInput(f"{key}={port} was given, but no port fits. {plugged_in()}")
