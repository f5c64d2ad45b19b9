"""A device at its port, with the time that bytes take on a wire, and with its troubles."""

import heapq
from collections.abc import Callable
from itertools import count

import numpy as np

from hardware.emulators.device import Device
from hardware.emulators.faults import spoilt
from hardware.emulators.pty import PseudoTerminal

BITS = 10  # of a byte on the wire: 8N1
NOISE_SHARE = 0.1  # of the ticks of a noisy wire bring bytes of their own


class EventQueue:
    """What is to be done when, by the host's clock."""

    def __init__(self) -> None:
        self._heap: list[tuple[float, int, Callable[[], None]]] = []
        self._order = count()

    def at(self, when_s: float, do: Callable[[], None]) -> None:
        """Once."""
        heapq.heappush(self._heap, (when_s, next(self._order), do))

    @property
    def next_s(self) -> float:
        """When there is something to do."""
        return self._heap[0][0] if self._heap else float("inf")

    def run(self, now_s: float) -> None:
        """What is due."""
        while self._heap and self._heap[0][0] <= now_s:
            heapq.heappop(self._heap)[2]()


class EmulatedPort:
    """Hears, lets the device answer, and sends when the question, what it thought and the answer would have taken their time."""

    def __init__(
        self, device: Device, port: PseudoTerminal, trouble: set[str], agenda: EventQueue, speed: float, rng: np.random.Generator
    ) -> None:
        self._device, self.port, self.trouble, self._agenda, self._rng = device, port, trouble, agenda, rng
        self._speed, self._heard_s, self._free_s = speed, 0.0, 0.0
        self._plugs = 0  # what was on its way when the plug was pulled never comes

    def _wire_s(self, data: bytes) -> float:
        return len(data) * BITS / self._device.baud / self._speed

    def hear(self, now_s: float) -> None:
        """Bytes came in. The answer is made at once and waits: to wake up twice would cost a busy host more than it is worth."""
        data = self.port.read()
        if data and "busy" not in self.trouble:
            data = spoilt(data, self.trouble, self._rng)
            self._heard_s = max(self._heard_s, now_s) + self._wire_s(data)
            answer = self._device.answer(data)
            self._say(answer, self._heard_s + self._device.pause_s / self._speed)

    def _say(self, data: bytes, from_s: float) -> None:
        if data:
            self._free_s, plug = max(self._free_s, from_s) + self._wire_s(data), self._plugs
            self._agenda.at(self._free_s, lambda: self._send(data, plug))

    def _send(self, data: bytes, plug: int) -> None:
        if plug == self._plugs and "busy" not in self.trouble:
            self.port.write(spoilt(data, self.trouble, self._rng))

    def tick(self, t_s: float, now_s: float) -> None:
        """The bench has come to t_s."""
        if ("unplug" in self.trouble) == self.port.plugged:
            self._replug(t_s)
        self._look(t_s)
        if self.port.plugged:
            self._say(self._device.spoken(t_s), now_s)
            if "noise" in self.trouble and self._rng.random() < NOISE_SHARE:
                self.port.write(self._rng.bytes(int(self._rng.integers(1, 9))))

    def _look(self, t_s: float) -> None:
        before = self.port.listened
        self.port.look()
        if self.port.listened and not before and self._device.boots_when_opened:
            self._plugs += 1
            self._device.powered(t_s)

    def _replug(self, t_s: float) -> None:
        self._plugs += 1
        if self.port.plugged:
            self.port.unplug()
        else:
            self.port.plug()
            self._device.powered(t_s)
