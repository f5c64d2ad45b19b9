"""A microcontroller with two ADC channels at 115200 baud (hardware/firmware/nose): `$NOSE,ms,active,adcA,adcB*HH`, for EC, MQ and MiCS."""

from collections import Counter
from dataclasses import dataclass

from hardware.codecs import line
from hardware.drivers.noses.reading_filter import ReadingFilter
from hardware.transport.clock import Clock, DeviceClock
from hardware.transport.device import Counts
from hardware.transport.microcontroller import BAUD, BOOT_S, acknowledged
from hardware.transport.port import NoAnswer, Wire
from oio.core.errors import BadInput
from oio.core.records import nanoseconds

INSIST_S = 1.5  # on a command
TURN_S = 0.1
SILENT = 1.5  # periods without a sentence
EARLY_NS = nanoseconds(0.01)  # a sample may be stamped so much earlier than a period after the last: its clock is learnt, and says whole ms


@dataclass(frozen=True, slots=True)
class Sentence:
    """What a frame says: the word behind the $, names of the fields behind it, names of the elements that there are, bits of a count."""

    talker: str
    columns: tuple[str, ...]
    elements: str
    adc_bits: int


class Line:
    """Takes every frame for a sample of the element it calls active, and asks for the other one."""

    key, name, baud = "backend.nose", "line", BAUD

    def __init__(self, intake: ReadingFilter, clock: Clock, sentence: Sentence, sample_s: float) -> None:
        self._intake, self._clock, self._device = intake, clock, DeviceClock()
        self._period_ms, self._sentence, self._names = round(1e3 * sample_s), sentence, sentence.elements
        self._at = {name: 1 + i for i, name in enumerate(sentence.columns)}
        self._lines, self._bad, self._last_ms, self._lost, self._heard_ns = line.Lines(), 0, -1, 0, clock.now_ns()

    def knock(self, wire: Wire) -> str | None:
        """Its name, version and bits."""
        try:
            return ", ".join(self._identity(wire)[2:])
        except NoAnswer:
            return None

    def begin(self, wire: Wire) -> None:
        """Set the period. Raises BadInput if its converter is not the one of the sensor's YAML."""
        who = self._identity(wire)
        if len(who) > 4 and who[4] != str(self._sentence.adc_bits):
            raise BadInput(
                f"the microcontroller at {self.key}.port converts to {who[4][:8]} bits, but sensor.adc_bits is {self._sentence.adc_bits}. "
                f"Type sensor.adc_bits={who[4][:8]}, or flash another firmware."
            )
        acknowledged(wire, self._lines, f"P{self._period_ms}", INSIST_S)
        self._last_ms, self._heard_ns = -1, self._clock.now_ns()

    def turn(self, wire: Wire) -> bool:
        """What came in; noise and other talkers are no sign of life."""
        data = wire.read(TURN_S)
        arrived_ns = self._clock.now_ns()
        said, ours = self._lines.feed(data), self._sentence.talker
        frames = [fields for fields in said if fields[0] == ours]
        for fields in frames:
            self._frame(wire, fields, arrived_ns)
        self._heard_ns = arrived_ns if frames else self._heard_ns
        silent = arrived_ns - self._heard_ns > nanoseconds(SILENT * 1e-3 * self._period_ms)
        if silent and (others := {fields[0] for fields in said} - {ours, "ACK", "NAK"}):
            raise NoAnswer(f"it says ${min(others)[:8]}, but backend.nose.talker is {ours}")
        return not silent

    def end(self, wire: Wire) -> None:
        """It goes on: heaters and bias stay on."""

    def counts(self) -> Counts:
        """Frames and samples so far; `lost` are those missing between the milliseconds of two frames."""
        f = self._lines
        frames = Counter(good=f.good, corrupt=f.corrupt + self._bad, skipped=f.skipped, lost=self._lost, clock=self._device.jumps)
        return frames + self._intake.counts

    def _frame(self, wire: Wire, fields: tuple[str, ...], arrived_ns: int) -> None:
        try:
            ms, active = _decimal(fields[self._at["ms"]]), fields[self._at["active"]]
            counts = {"A": _decimal(fields[self._at["adcA"]]), "B": _decimal(fields[self._at["adcB"]])}
            raw = counts[active]
        except (IndexError, KeyError, ValueError):
            self._bad += 1  # its checksum is right, what it says is not
            return
        since_ms = ms - self._last_ms if 0 <= self._last_ms < ms else 0
        self._lost += max(round(since_ms / self._period_ms) - 1, 0)
        self._last_ms = ms
        other = self._names[(self._names.find(active) + 1) % len(self._names)]
        if active in self._names:
            t_ns = self._device.stamped(ms, arrived_ns)
            self._intake.put(t_ns, self._names.index(active), raw, arrived_ns)
            self._intake.none_before(t_ns + nanoseconds(1e-3 * min(since_ms, self._period_ms)) - EARLY_NS)  # it may be faster than asked
        if other != active:
            wire.write(f"S{other}\n".encode())

    def _identity(self, wire: Wire) -> tuple[str, ...]:
        return acknowledged(wire, self._lines, "ID", BOOT_S)


def _decimal(text: str) -> int:
    """Raises ValueError for anything but digits: `int` takes signs, blanks and underscores too."""
    if not text.isdecimal():
        raise ValueError(text)
    return int(text)
