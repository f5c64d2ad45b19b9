"""Driver of a microcontroller with two ADC channels, 115200 baud (hardware/firmware/nose): `$NOSE,ms,active,adcA,adcB*HH`; EC, MQ, MiCS."""

from collections import Counter
from dataclasses import dataclass

from hardware.codecs import line
from hardware.drivers.noses.reading_filter import ReadingFilter
from hardware.transport.clock import Clock, DeviceClock
from hardware.transport.driver import Counts
from hardware.transport.microcontroller import BAUD, BOOT_S, acknowledged
from hardware.transport.port import NoAnswer, Wire
from oio.core.errors import BadInput
from oio.core.records import nanoseconds

INSIST_S = 1.5  # time-out of a command, with its retries
TURN_S = 0.1  # longest wait for bytes in one poll
SILENT = 1.5  # periods without a frame, after which the device counts as silent
EARLY_NS = nanoseconds(0.005)  # tolerance of a stamp before one period after the last: the clock offset is estimated from whole ms


@dataclass(frozen=True, slots=True)
class Sentence:
    """Sentence format: talker (the word after the $), names of its fields, names of the sensor's elements, ADC resolution [bit]."""

    talker: str
    columns: tuple[str, ...]
    elements: str
    adc_bits: int


class Line:
    """Driver that takes each frame as a sample of its active element and then selects the other element."""

    key, name, baud = "backend.nose", "line", BAUD

    def __init__(self, intake: ReadingFilter, clock: Clock, sentence: Sentence, sample_s: float) -> None:
        self._intake, self._clock, self._device_clock = intake, clock, DeviceClock()
        self._period_ms, self._sentence, self._elements = round(1e3 * sample_s), sentence, sentence.elements
        self._column = {name: 1 + i for i, name in enumerate(sentence.columns)}
        self._lines, self._invalid, self._last_ms, self._lost, self._last_frame_ns = line.Lines(), 0, -1, 0, clock.now_ns()

    def identify(self, wire: Wire) -> str | None:
        """Return firmware name, version and ADC resolution; None on a time-out."""
        try:
            return ", ".join(self._identity(wire)[2:])
        except NoAnswer:
            return None

    def configure(self, wire: Wire) -> str:
        """Set the sampling period. Raises BadInput if the ADC resolution differs from that in the sensor's YAML."""
        info = self._identity(wire)
        if len(info) > 4 and info[4] != str(self._sentence.adc_bits):
            raise BadInput(
                f"the microcontroller at {self.key}.port converts to {info[4][:8]} bits, but sensor.adc_bits is {self._sentence.adc_bits}. "
                f"Type sensor.adc_bits={info[4][:8]}, or flash another firmware."
            )
        acknowledged(wire, self._lines, f"P{self._period_ms}", INSIST_S)
        self._last_ms, self._last_frame_ns = -1, self._clock.now_ns()
        return ", ".join(info[2:])

    def poll(self, wire: Wire) -> bool:
        """Read the frames received; noise and sentences of other talkers do not count as an answer."""
        data = wire.read(TURN_S)
        arrived_ns = self._clock.now_ns()
        sentences, talker = self._lines.feed(data), self._sentence.talker
        frames = [fields for fields in sentences if fields[0] == talker]
        for fields in frames:
            self._frame(wire, fields, arrived_ns)
        if not data:
            self._device_clock.settle()
        self._last_frame_ns = arrived_ns if frames else self._last_frame_ns
        silent = arrived_ns - self._last_frame_ns > nanoseconds(SILENT * 1e-3 * self._period_ms)
        if silent and (others := {fields[0] for fields in sentences} - {talker, "ACK", "NAK"}):
            raise NoAnswer(f"it says ${min(others)[:8]}, but backend.nose.talker is {talker}")
        return not silent

    def release(self, wire: Wire) -> None:
        """Do nothing: heaters and bias stay on."""

    def counts(self) -> Counts:
        """Frames and samples so far; `lost` are those missing between the time stamps of two consecutive frames."""
        f = self._lines
        frames = Counter(good=f.good, corrupt=f.corrupt + self._invalid, skipped=f.skipped, lost=self._lost, clock=self._device_clock.jumps)
        return frames + self._intake.counts

    def _frame(self, wire: Wire, fields: tuple[str, ...], arrived_ns: int) -> None:
        try:
            ms, active = _decimal(fields[self._column["ms"]]), fields[self._column["active"]]
            counts = {"A": _decimal(fields[self._column["adcA"]]), "B": _decimal(fields[self._column["adcB"]])}
            raw = counts[active]
        except (IndexError, KeyError, ValueError):
            self._invalid += 1  # valid checksum, invalid fields
            return
        since_ms = ms - self._last_ms if 0 <= self._last_ms < ms else 0
        self._lost += max(round(since_ms / self._period_ms) - 1, 0)
        self._last_ms = ms
        other = self._elements[(self._elements.find(active) + 1) % len(self._elements)]
        if active in self._elements:
            t_ns = self._device_clock.to_world_ns(ms, arrived_ns)
            self._intake.put(t_ns, self._elements.index(active), raw, arrived_ns)
            self._intake.none_before(t_ns + nanoseconds(1e-3 * min(since_ms, self._period_ms)) - EARLY_NS)  # may be faster than set
        if other != active:
            wire.write(f"S{other}\n".encode())

    def _identity(self, wire: Wire) -> tuple[str, ...]:
        return acknowledged(wire, self._lines, "ID", BOOT_S)


def _decimal(text: str) -> int:
    """Parse decimal digits. Raises ValueError for anything else: `int` accepts signs, blanks and underscores too."""
    if not text.isdecimal():
        raise ValueError(text)
    return int(text)
