"""Emulated device at its port, with transmission times and wire faults."""

import heapq
from collections.abc import Callable
from itertools import count

import numpy as np

from hardware.emulators.device import Device
from hardware.emulators.faults import corrupt
from hardware.emulators.pty import PseudoTerminal

BITS = 10  # bits per byte on the wire: 8N1
NOISE_SHARE = 0.1  # fraction of the ticks at which a noisy wire produces bytes of its own


class EventQueue:
    """Priority queue of timed actions, on the host clock."""

    def __init__(self) -> None:
        self._heap: list[tuple[float, int, Callable[[], None]]] = []
        self._order = count()

    def at(self, when_s: float, do: Callable[[], None]) -> None:
        """Schedule an action for once at when_s [host s]."""
        heapq.heappush(self._heap, (when_s, next(self._order), do))

    @property
    def next_s(self) -> float:
        """Time of the next action [host s]; infinity if there is none."""
        return self._heap[0][0] if self._heap else float("inf")

    def run(self, now_s: float) -> None:
        """Run the actions that are due at now_s."""
        while self._heap and self._heap[0][0] <= now_s:
            heapq.heappop(self._heap)[2]()


class EmulatedPort:
    """Port of one emulated device: a reply is sent after the transmission time of request and reply and the processing time."""

    def __init__(
        self, device: Device, port: PseudoTerminal, trouble: set[str], agenda: EventQueue, speed: float, rng: np.random.Generator
    ) -> None:
        self._device, self.port, self.trouble, self._agenda, self._rng = device, port, trouble, agenda, rng
        self._speed, self._received_s, self._line_free_s = speed, 0.0, 0.0
        self._connection = 0  # connection number: bytes in transit at an unplugging are lost

    def _wire_s(self, data: bytes) -> float:
        return len(data) * BITS / self._device.baud / self._speed

    def hear(self, now_s: float) -> None:
        """Read a request at now_s. The reply is computed at once and then delayed, which saves a wake-up of a busy host."""
        data = self.port.read()
        if data and "busy" not in self.trouble:
            data = corrupt(data, self.trouble, self._rng)
            self._received_s = max(self._received_s, now_s) + self._wire_s(data)
            answer = self._device.answer(data)
            self._queue_send(answer, self._received_s + self._device.pause_s / self._speed)

    def _queue_send(self, data: bytes, from_s: float) -> None:
        if data:
            self._line_free_s, connection = max(self._line_free_s, from_s) + self._wire_s(data), self._connection
            self._agenda.at(self._line_free_s, lambda: self._send(data, connection))

    def _send(self, data: bytes, connection: int) -> None:
        if connection == self._connection and "busy" not in self.trouble:
            self.port.write(corrupt(data, self.trouble, self._rng))

    def tick(self, t_s: float, now_s: float) -> None:
        """Advance the device to bench time t_s, host time now_s."""
        if ("unplug" in self.trouble) == self.port.plugged:
            self._toggle_plug(t_s)
        self._check_opened(t_s)
        if self.port.plugged:
            self._queue_send(self._device.tick(t_s), now_s)
            if "noise" in self.trouble and self._rng.random() < NOISE_SHARE:
                self.port.write(self._rng.bytes(int(self._rng.integers(1, 9))))

    def _check_opened(self, t_s: float) -> None:
        before = self.port.listened
        self.port.look()
        if self.port.listened and not before and self._device.boots_when_opened:
            self._connection += 1
            self._device.power_on(t_s)

    def _toggle_plug(self, t_s: float) -> None:
        self._connection += 1
        if self.port.plugged:
            self.port.unplug()
        else:
            self.port.plug()
            self._device.power_on(t_s)
