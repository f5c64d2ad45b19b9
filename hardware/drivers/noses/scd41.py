"""Driver of a Sensirion SCD41 on a SEK-SensorBridge: SHDLC at 460800 baud, behind it I2C address 0x62 (data sheet v1.7, April 2025)."""

import time
from collections import Counter

from hardware.codecs import scd4x, shdlc
from hardware.drivers.noses.poll_schedule import PollSchedule
from hardware.drivers.noses.reading_filter import ReadingFilter
from hardware.transport.clock import Clock
from hardware.transport.driver import Counts
from hardware.transport.port import NoAnswer, Wire
from hardware.transport.request import request

BRIDGE, SENSOR = 0x00, 0x62
# commands of the bridge, for its first port: 3.3 V, supply on, 100 kHz; as in Sensirion's own driver
VOLTAGE, SUPPLY, FREQUENCY, TRANSCEIVE, INFORMATION = 0x00, 0x01, 0x02, 0x11, 0xD0
FIRST_PORT, ON, VOLTS_3_3, KHZ_100, NAME = 0x00, 0x01, 0x02, 0x00, b"\x01"
ERROR = 0x7F  # error bits of the state byte; its top bit only reports that some error is pending
VARIANT_SCD41 = 0x1440
STOP_S, WAKE_S = 0.5, 0.03  # data sheet: after stop, after power-up
TRIES, AGAIN_S = 4, 0.1
LEAST_S = 5.0  # between two values
I2C_US = 100_000
ANSWER_S = 0.3


class Scd41:
    """Driver that polls the data-ready status and reads the measurement when it is ready."""

    key, name, baud = "backend.nose", "scd41", 460_800

    def __init__(self, intake: ReadingFilter, clock: Clock, sample_s: float) -> None:
        self._intake, self._clock = intake, clock
        self._schedule = PollSchedule(clock, sample_s, LEAST_S)
        self._frames, self._lost, self._refused, self._bad = shdlc.Miso(), 0, 0, 0

    def identify(self, wire: Wire) -> str | None:
        """Return the product name of the bridge; None on a time-out."""
        try:
            data = self._bridge(wire, INFORMATION, NAME)
        except NoAnswer:
            return None
        return bytes(c for c in data if 32 <= c < 127).decode("ascii") or "a bridge"

    def configure(self, wire: Wire) -> str:
        """Switch the sensor's supply on and start periodic measurement."""
        if (bridge := self.identify(wire)) is None:
            raise NoAnswer("no SensorBridge answers")
        self._bridge(wire, VOLTAGE, bytes((FIRST_PORT, VOLTS_3_3)))
        self._bridge(wire, FREQUENCY, bytes((FIRST_PORT, KHZ_100)))
        self._bridge(wire, SUPPLY, bytes((FIRST_PORT, ON)))
        time.sleep(WAKE_S)
        self._sensor(wire, scd4x.STOP, 0)  # if it is still measuring it accepts no other command
        time.sleep(self._clock.host_s(STOP_S))
        if not self._is_scd41(wire):
            raise NoAnswer("the bridge answers, but no SCD41 behind it")
        number = self._words(wire, scd4x.SERIAL, 3)
        self._sensor(wire, scd4x.START, 0)
        self._schedule.started()
        return f"{bridge}, SCD41" + (f" {''.join(f'{word:04x}' for word in number)}" if number else "")

    def _is_scd41(self, wire: Wire) -> bool:
        """Whether the sensor identifies itself as an SCD41; with retries, because stopping may take a little longer."""
        for _ in range(TRIES):
            variant = self._words(wire, scd4x.VARIANT, 1)
            if variant is not None:
                return variant[0] & 0xF000 == VARIANT_SCD41 & 0xF000
            time.sleep(AGAIN_S)
        return False

    def poll(self, wire: Wire) -> bool:
        """Poll once; a value is stamped with the time of the request that reported it ready."""
        if self._schedule.rested():
            return True  # not polled, hence not silent
        asked_ns = self._clock.now_ns()
        self._intake.none_before(asked_ns)
        try:
            ready = self._words(wire, scd4x.READY, 1)
            words = self._words(wire, scd4x.READ, 3) if ready and ready[0] & 0x07FF else None
        except NoAnswer:
            self._lost += 1
            raise
        if words is None:
            self._schedule.check()
        else:
            self._schedule.new(asked_ns)
            self._intake.put(asked_ns, 0, scd4x.measured(words)[0], self._clock.now_ns())
        return ready is not None

    def release(self, wire: Wire) -> None:
        """Do nothing: the sensor goes on measuring."""

    def counts(self) -> Counts:
        """Frames and samples so far; `refused` are answers with an error in their state, `bad` words with a wrong CRC."""
        f = self._frames
        frames = Counter(good=f.good, corrupt=f.corrupt, skipped=f.skipped, lost=self._lost, refused=self._refused, bad=self._bad)
        return frames + self._intake.counts

    def _words(self, wire: Wire, command: int, count: int) -> tuple[int, ...] | None:
        """Words of the sensor's answer; None if it refused or a CRC is wrong."""
        data = self._sensor(wire, command, 3 * count)
        words = None if data is None else scd4x.unpacked(data)
        if data is not None and words is None:
            self._bad += 1
        return words if words is not None and len(words) == count else None

    def _sensor(self, wire: Wire, command: int, answer: int) -> bytes | None:
        """Bytes of the sensor's answer; None if it did not acknowledge."""
        payload = scd4x.transceive(SENSOR, command.to_bytes(2, "big"), answer, I2C_US)
        frame = self._request(wire, TRANSCEIVE, payload)
        if frame.state & ERROR:
            self._refused += 1
            return None
        return frame.data

    def _bridge(self, wire: Wire, command: int, data: bytes) -> bytes:
        frame = self._request(wire, command, data)
        if frame.state & ERROR:
            raise NoAnswer(f"the bridge refuses command {command:#04x} with state {frame.state:#04x}")
        return frame.data

    def _request(self, wire: Wire, command: int, data: bytes) -> shdlc.Frame:
        return request(wire, shdlc.mosi(BRIDGE, command, data), self._frames, lambda f: f.command == command, ANSWER_S)
