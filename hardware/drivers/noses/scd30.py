"""Driver of a Sensirion SCD30 over UART: Modbus RTU at 19200 baud, address 0x61 (interface description v1.0, May 2020)."""

import time
from collections import Counter

from hardware.codecs import modbus
from hardware.drivers.noses.poll_schedule import PollSchedule
from hardware.drivers.noses.reading_filter import ReadingFilter
from hardware.transport.clock import Clock
from hardware.transport.driver import Counts
from hardware.transport.port import NoAnswer, Wire
from hardware.transport.request import request

ADDRESS = 0x61
FIRMWARE, INTERVAL, READY, VALUES, START = 0x0020, 0x0025, 0x0027, 0x0028, 0x0036
INTERVAL_S = (2, 1800)  # range of the register [s]
SILENCE_S = 0.004  # Modbus requires 3.5 characters of silence between two frames: 2 ms
ANSWER_S = 0.25  # 17 bytes take 9 ms, plus the response time of the device


class Scd30:
    """Driver that polls the data-ready register and reads the measurement when it is ready."""

    key, name, baud = "backend.nose", "scd30", 19_200

    def __init__(self, intake: ReadingFilter, clock: Clock, sample_s: float) -> None:
        self._intake, self._clock, self._sample_s = intake, clock, sample_s
        self._replies, self._lost = modbus.Replies(ADDRESS), 0
        self._schedule = PollSchedule(clock, sample_s, INTERVAL_S[0])

    def identify(self, wire: Wire) -> str | None:
        """Return the firmware version; None on a time-out."""
        try:
            major, minor = divmod(self._read(wire, FIRMWARE, 1)[0], 256)
        except NoAnswer:
            return None
        return f"SCD30, firmware {major}.{minor}"

    def configure(self, wire: Wire) -> str:
        """Start continuous measurement at the interval nearest to the sampling period, without pressure compensation."""
        if (identity := self.identify(wire)) is None:
            raise NoAnswer("it does not answer as an SCD30 does")
        wanted = min(max(round(self._sample_s), INTERVAL_S[0]), INTERVAL_S[1])
        if self._read(wire, INTERVAL, 1)[0] != wanted:  # it is stored in flash, which wears
            self._write(wire, INTERVAL, wanted)
        self._write(wire, START, 0)
        self._schedule.started()
        return identity

    def poll(self, wire: Wire) -> bool:
        """Poll once; a value is stamped with the time of the request that reported it ready."""
        if self._schedule.rested():
            return True  # not polled, hence not silent
        asked_ns = self._clock.now_ns()
        self._intake.none_before(asked_ns)
        try:
            if self._read(wire, READY, 1)[0] != 1:
                self._schedule.check()
                return True
            ppm = modbus.floats(self._read(wire, VALUES, 6))[0]
        except NoAnswer:
            self._lost += 1
            raise
        self._schedule.new(asked_ns)
        self._intake.put(asked_ns, 0, ppm, self._clock.now_ns())
        return True

    def release(self, wire: Wire) -> None:
        """Do nothing: the sensor goes on measuring, so that its lamp does not cool."""

    def counts(self) -> Counts:
        """Frames and samples so far."""
        r = self._replies
        return Counter(good=r.good, corrupt=r.corrupt, skipped=r.skipped, lost=self._lost) + self._intake.counts

    def _read(self, wire: Wire, register: int, count: int) -> tuple[int, ...]:
        time.sleep(SILENCE_S)
        question = modbus.read_request(ADDRESS, register, count)
        reply = request(wire, question, self._replies, lambda r: isinstance(r, modbus.ExceptionResponse) or len(r.words) == count, ANSWER_S)
        if isinstance(reply, modbus.ExceptionResponse):
            raise NoAnswer(f"refused with code {reply.code}")
        return reply.words

    def _write(self, wire: Wire, register: int, value: int) -> None:
        time.sleep(SILENCE_S)
        question = modbus.write_request(ADDRESS, register, value)
        reply = request(wire, question, self._replies, lambda r: r.function in (6, 0x86), ANSWER_S)
        if isinstance(reply, modbus.ExceptionResponse):
            raise NoAnswer(f"register {register:#06x} refused with code {reply.code}")
