"""Rates of the serial ports: the bauds of the drivers, and how long an FTDI chip holds short answers back."""

import termios
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

from oio.core.settings import Within, settings
from oio.doctor.finding import FAIL, PASS, WARN, Finding


@settings
class Rates:
    """Bauds that the drivers need, where Linux lists latency timers, and the longest that is quick enough [ms]."""

    bauds: Annotated[tuple[int, ...], Within(50, 4_000_000)]
    devices: str
    latency_ms: Annotated[int, Within(1, 255)]

    def check(self) -> Finding:
        """FAIL if the system lacks a baud, WARN for a slow latency timer."""
        lacking = [baud for baud in self.bauds if not hasattr(termios, f"B{baud}")]
        return self.judge(lacking, timers(Path(self.devices)))

    def judge(self, lacking: list[int], timers_ms: Mapping[str, int]) -> Finding:
        """Judge the bauds that the system lacks, and the latency timers [ms] by port."""
        if lacking:
            return Finding("rates", FAIL, f"no {', '.join(map(str, lacking))} baud", "Use a Linux whose serial ports know these rates.")
        slow = {port: ms for port, ms in timers_ms.items() if ms > self.latency_ms}
        if slow:
            port = next(iter(slow))
            found = ", ".join(f"{port} holds answers back for {ms} ms" for port, ms in slow.items())
            action = f"Drivers ask for 1 ms themselves; if that fails: echo 1 | sudo tee {self.devices}/{port}/latency_timer"
            return Finding("rates", WARN, found, action)
        told = ", ".join(f"{port} {ms} ms" for port, ms in timers_ms.items()) or "no FTDI chip"
        return Finding("rates", PASS, f"up to {max(self.bauds)} baud; latency timers: {told}")


def timers(devices: Path) -> dict[str, int]:
    """Return the latency timer [ms] of every port that has one; ports without are of other chips."""
    found = dict[str, int]()
    for path in sorted(devices.glob("*/latency_timer")):
        try:
            found[path.parent.name] = int(path.read_text(encoding="ascii"))
        except (OSError, ValueError):
            continue
    return found
