"""The computer's clocks: samples are stamped by the monotonic one, folders and reports are named by the wall clock."""

import shutil
import subprocess
import time
from dataclasses import dataclass
from typing import Annotated

from oio.core.settings import Within, settings
from oio.doctor.finding import FAIL, PASS, WARN, Finding

ASK_S = 2.0  # for the state of NTP


@dataclass(frozen=True, slots=True)
class Clocks:
    """Resolution of the monotonic clock [s], how far the wall clock jumped against it [s], and whether NTP sets it (None: unknown)."""

    resolution_s: float
    jump_s: float
    synchronised: bool | None


@settings
class Clock:
    """Limits of the clocks, and how long they are watched."""

    resolution_s: Annotated[float, Within(1e-9, 1)]
    jump_s: Annotated[float, Within(1e-6, 60)]
    watch_s: Annotated[float, Within(0, 60)]

    def check(self) -> Finding:
        """FAIL for a coarse monotonic clock; WARN for a wall clock that jumps, or that nothing sets."""
        before_s = time.time() - time.monotonic()
        time.sleep(self.watch_s)
        jump_s = abs(time.time() - time.monotonic() - before_s)
        return self.judge(Clocks(time.get_clock_info("monotonic").resolution, jump_s, _synchronised()))

    def judge(self, clocks: Clocks) -> Finding:
        """Judge what was read of the clocks."""
        found = f"monotonic clock to {1e9 * clocks.resolution_s:.3g} ns, {_NTP[clocks.synchronised]}"
        if clocks.resolution_s > self.resolution_s:
            return Finding(
                "clock", FAIL, found, f"Use a system whose clock is finer than {1e3 * self.resolution_s:g} ms: joints come every 8 ms."
            )
        if clocks.jump_s > self.jump_s:
            jumped = f"the wall clock jumped by {1e3 * clocks.jump_s:.0f} ms in {self.watch_s:g} s"
            return Finding("clock", WARN, jumped, "Wait until NTP has set it. Samples do not depend on it; names of folders do.")
        if clocks.synchronised is False:
            return Finding("clock", WARN, found, "Type sudo timedatectl set-ntp true, or set the date: folders are named by it.")
        return Finding("clock", PASS, found)


_NTP = {True: "wall clock set by NTP", False: "wall clock not set by NTP", None: "state of NTP cannot be read"}


def _synchronised() -> bool | None:
    if shutil.which("timedatectl") is None:
        return None
    command = ["timedatectl", "show", "--property=NTPSynchronized", "--value"]
    try:
        said = subprocess.run(command, capture_output=True, text=True, check=False, timeout=ASK_S).stdout.strip()
    except (OSError, subprocess.TimeoutExpired):
        return None
    return {"yes": True, "no": False}.get(said)
