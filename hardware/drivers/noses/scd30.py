"""Sensirion SCD30 over UART: Modbus RTU at 19200 baud, address 0x61 (interface description v1.0, May 2020)."""

import time
from collections import Counter

from hardware.codecs import modbus
from hardware.drivers.noses.poll_schedule import PollSchedule
from hardware.drivers.noses.reading_filter import ReadingFilter
from hardware.transport.clock import Clock
from hardware.transport.device import Counts
from hardware.transport.port import NoAnswer, Wire
from hardware.transport.request import request

ADDRESS = 0x61
FIRMWARE, INTERVAL, READY, VALUES, START = 0x0020, 0x0025, 0x0027, 0x0028, 0x0036
INTERVAL_S = (2, 1800)  # what the register takes [s]
SILENCE_S = 0.004  # between two frames Modbus wants 3.5 characters: 2 ms
ANSWER_S = 0.25  # 17 bytes take 9 ms, and the device thinks for some


class Scd30:
    """Asks whether there is a new value, and for it."""

    key, name, baud = "backend.nose", "scd30", 19_200

    def __init__(self, intake: ReadingFilter, clock: Clock, sample_s: float) -> None:
        self._intake, self._clock, self._sample_s = intake, clock, sample_s
        self._replies, self._lost = modbus.Replies(ADDRESS), 0
        self._pace = PollSchedule(clock, sample_s, INTERVAL_S[0])

    def knock(self, wire: Wire) -> str | None:
        """Its firmware."""
        try:
            major, minor = divmod(self._read(wire, FIRMWARE, 1)[0], 256)
        except NoAnswer:
            return None
        return f"SCD30, firmware {major}.{minor}"

    def begin(self, wire: Wire) -> None:
        """Start measuring, as often as it can and is asked to; without pressure compensation."""
        if self.knock(wire) is None:
            raise NoAnswer("it does not answer as an SCD30 does")
        wanted = min(max(round(self._sample_s), INTERVAL_S[0]), INTERVAL_S[1])
        if self._read(wire, INTERVAL, 1)[0] != wanted:  # it is kept in flash, which wears
            self._write(wire, INTERVAL, wanted)
        self._write(wire, START, 0)
        self._pace.started()

    def turn(self, wire: Wire) -> bool:
        """Ask; a value is as old as the question that was answered with yes."""
        if self._pace.rested():
            return True  # it was not asked
        asked_ns = self._clock.now_ns()
        self._intake.none_before(asked_ns)
        try:
            if self._read(wire, READY, 1)[0] != 1:
                self._pace.check()
                return True
            ppm = modbus.floats(self._read(wire, VALUES, 6))[0]
        except NoAnswer:
            self._lost += 1
            raise
        self._pace.new(asked_ns)
        if ppm != 0.0:  # which is said before the first measurement
            self._intake.put(asked_ns, 0, ppm, self._clock.now_ns())
        return True

    def end(self, wire: Wire) -> None:
        """It goes on measuring: its lamp must not cool."""

    def counts(self) -> Counts:
        """Frames and samples so far."""
        r = self._replies
        return Counter(good=r.good, corrupt=r.corrupt, skipped=r.skipped, lost=self._lost) + self._intake.counts

    def _read(self, wire: Wire, register: int, count: int) -> tuple[int, ...]:
        time.sleep(SILENCE_S)
        question = modbus.read_request(ADDRESS, register, count)
        reply = request(wire, question, self._replies, lambda r: isinstance(r, modbus.Refusal) or len(r.words) == count, ANSWER_S)
        if isinstance(reply, modbus.Refusal):
            raise NoAnswer(f"refused with code {reply.code}")
        return reply.words

    def _write(self, wire: Wire, register: int, value: int) -> None:
        time.sleep(SILENCE_S)
        question = modbus.write_request(ADDRESS, register, value)
        reply = request(wire, question, self._replies, lambda r: r.function in (6, 0x86), ANSWER_S)
        if isinstance(reply, modbus.Refusal):
            raise NoAnswer(f"register {register:#06x} refused with code {reply.code}")
