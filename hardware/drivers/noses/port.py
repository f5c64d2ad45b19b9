"""Drivers of real noses, and which of them is at which port."""

from hardware.drivers.noses import line, scd30, scd41
from hardware.drivers.noses.reading_filter import ReadingFilter
from hardware.transport.clock import Clock
from hardware.transport.device import Driver
from hardware.transport.mailbox import Mailbox
from oio.core.errors import BadInput
from oio.core.interfaces import Sensor
from oio.core.records import GasSample
from oio.core.settings import in_range, settings

DRIVERS = ("scd30", "scd41", "line")
NEEDED = ("ms", "active", "adcA", "adcB")
NEVER = 1 << 62


@settings
class NosePort:
    """One nose: its language, its port, and for `line` where in a sentence what stands."""

    driver: str
    port: str  # a path, usb:VENDOR:PRODUCT[:SERIAL], or ask
    talker: str  # the word behind the $
    columns: tuple[str, ...]  # of the sentence behind the talker; NEEDED must be among them
    stuck_after: int  # readings in a row that are equal to the last digit: those after them are dropped

    def check(self) -> None:
        """Refuse unknown drivers and sentences without what is needed."""
        if self.driver not in DRIVERS:
            raise BadInput(
                f"backend.nose.driver={self.driver} was given, but it can be {', '.join(DRIVERS)}. Type backend.nose.driver=line."
            )
        missing = [name for name in NEEDED if name not in self.columns]
        if missing:
            raise BadInput(f"backend.nose.columns is {list(self.columns)}, but {missing[0]} is needed too. Type e.g. {list(NEEDED)}.")
        in_range(self, stuck_after=(2, 10**6))

    @property
    def least_s(self) -> float:
        """How often a real part has something new at best [s]."""
        return {"scd30": scd30.INTERVAL_S[0], "scd41": scd41.LEAST_S}.get(self.driver, 0.0)

    def live(self, sensor: Sensor, clock: Clock, mailbox: Mailbox) -> Driver:
        """The driver of `sensor`. Raises BadInput if they cannot be one thing."""
        bits = getattr(sensor, "adc_bits", None)
        if (self.driver == "line") != (bits is not None):
            fits = "scd30 or scd41, which say ppm" if bits is None else "line, which says counts"
            raise BadInput(f"sensor={sensor.name} goes with {fits}, but backend.nose.driver={self.driver} was given.")
        stuck_after = self.stuck_after if _noisy(sensor) else NEVER
        intake = ReadingFilter(mailbox, sensor.elements, sensor.highest_raw, stuck_after)
        if self.driver == "line":
            assert isinstance(bits, int)
            sentence = line.Sentence(self.talker, self.columns, "AB"[: sensor.elements], bits)
            return line.Line(intake, clock, sentence, sensor.sample_s)
        made = scd30.Scd30 if self.driver == "scd30" else scd41.Scd41
        return made(intake, clock, sensor.sample_s)


def _noisy(sensor: Sensor) -> bool:
    """Whether the noise of clean air moves the raw value by a count or more: else it may stay the same for minutes and be sound."""
    clean = sensor.raw(0.0)
    sigma_ppm = sensor.reading(GasSample(0, 0, clean)).sigma_ppm
    return abs(sensor.raw(sigma_ppm) - clean) >= 1.0
