"""Whether the serial ports on USB may be opened by who is logged in; those built into a computer are nobody's bench."""

import grp
import os
from collections.abc import Mapping
from pathlib import Path

from serial.tools import list_ports

from oio.core.settings import settings
from oio.doctor.finding import FAIL, PASS, WARN, Finding


@settings
class Rights:
    """Group that may open ports on most systems."""

    group: str

    def check(self) -> Finding:
        """FAIL if a port may not be opened, WARN if there is none and the user is not in the group."""
        ports = {info.device: _group_of(Path(info.device)) for info in list_ports.comports() if info.vid is not None}
        closed = {path: group for path, group in ports.items() if not os.access(path, os.R_OK | os.W_OK)}
        return self.judge(len(ports), closed, os.geteuid() == 0 or self.group in _own_groups())

    def judge(self, count: int, closed: Mapping[str, str], may: bool) -> Finding:
        """Judge the number of ports, those that may not be opened with the group of each, and whether the user is in the usual group."""
        if closed:
            group = next(iter(closed.values()))
            action = f"Type sudo usermod -aG {group} $USER, then log in again."
            return Finding("rights", FAIL, f"you may not open {', '.join(closed)}", action)
        if not count and not may:
            action = f"For a bench type sudo usermod -aG {self.group} $USER, then log in again."
            return Finding("rights", WARN, f"no port to try, and you are not in the group {self.group}", action)
        return Finding("rights", PASS, f"you may open {count} of {count}" if count else "you may open ports, if there were any")


def _group_of(path: Path) -> str:
    try:
        return path.group()
    except (OSError, KeyError):
        return "dialout"


def _own_groups() -> set[str]:
    known = {entry.gr_gid: entry.gr_name for entry in grp.getgrall()}
    return {known.get(gid, str(gid)) for gid in (os.getegid(), *os.getgroups())}
