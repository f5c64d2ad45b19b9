"""Link statistics of a live world: every frame and sample, the evenness of the joints, the latency from a last byte to the belief."""

from collections import deque
from collections.abc import Iterable
from typing import Any

import numpy as np

from hardware.drivers.arms.arm_driver import ArmDriver
from hardware.drivers.arms.fixed_mount import FixedMount
from hardware.transport.device import Device
from hardware.transport.mailbox import Mailbox
from oio.core.records import GasSample, JointState, seconds

LATENCIES = 10_000  # kept


class LinkAccount:
    """Counts what a live world delivers."""

    def __init__(self, devices: list[Device[Any]], mover: ArmDriver[Any] | FixedMount, mailbox: Mailbox) -> None:
        self._devices, self._mover, self._mailbox = devices, mover, mailbox
        self._delivered, self._delivered_homing, self._late = {"gas": 0, "joints": 0}, {"gas": 0, "joints": 0}, 0
        self._latencies_s, self._awaited_s = deque[float](maxlen=LATENCIES), deque[float](maxlen=LATENCIES)

    def delivered(self, sample: JointState | GasSample) -> None:
        """A sample was given to the pipeline."""
        self._delivered["gas" if isinstance(sample, GasSample) else "joints"] += 1

    def late(self) -> None:
        """A sample came after younger ones had been delivered."""
        self._late += 1

    def latency(self, s: float, awaited: bool) -> None:
        """Seconds from the last byte of a gas sample until its belief; `awaited`: the pipeline made no map when that byte came."""
        self._latencies_s.append(s)
        if awaited:
            self._awaited_s.append(s)

    def source_opened(self) -> None:
        """Latencies count from the opening of a source: those of a search, not of the warm-up."""
        self._latencies_s.clear()
        self._awaited_s.clear()

    def homed(self) -> None:
        """The first move has ended; its samples are counted apart."""
        self._delivered_homing, self._delivered = self._delivered, {"gas": 0, "joints": 0}

    def __str__(self) -> str:
        """All of it as one line for the log."""
        parts = [_of_device(device) for device in self._devices]
        if isinstance(self._mover, ArmDriver):
            parts.append(f"joints {self._mover.jitter}, {self._mover.health_summary}")
        delivered, homing, waiting = self._delivered, self._delivered_homing, (len(self._mailbox.gas), len(self._mailbox.joints))
        parts.append(f"taken {delivered['gas']} gas {delivered['joints']} joints, waiting {waiting[0]} and {waiting[1]}")
        parts.append(f"on the first way home {homing['gas']} and {homing['joints']}")
        parts.append(f"late {self._late}, overflown {self._mailbox.lost}")
        if self._awaited_s:
            during = f" ({_quantiles_ms(self._latencies_s)} of all, those that came during a map too)"
            parts.append(f"last byte to belief {_quantiles_ms(self._awaited_s)}{during}")
        return "; ".join(parts)


def _quantiles_ms(latencies_s: Iterable[float]) -> str:
    median, high = 1e3 * np.quantile(np.array(list(latencies_s)), (0.5, 0.95))
    return f"{median:.2f} ms median, {high:.2f} ms 95 %"


def _of_device(device: Device[Any]) -> str:
    counts = ", ".join(f"{key} {value}" for key, value in sorted(device.driver.counts().items()))
    return f"{device.driver.key} {device.driver.name}: {counts}, opened anew {device.reconnects}, away {seconds(device.away_ns):.1f} s"
