"""Configuration of a real gas sensor's port: driver selection and sentence format."""

from typing import Annotated

from hardware.drivers.noses import line, scd30, scd41
from hardware.drivers.noses.reading_filter import ReadingFilter
from hardware.transport.clock import Clock
from hardware.transport.driver import SerialDriver
from hardware.transport.mailbox import Mailbox
from oio.core.errors import BadInput
from oio.core.interfaces import Sensor
from oio.core.records import GasSample
from oio.core.settings import Within, settings

DRIVERS = ("scd30", "scd41", "line")
NEEDED = ("ms", "active", "adcA", "adcB")
NEVER = 1 << 62


@settings
class NosePort:
    """Port of one gas sensor: driver, port and, for `line`, the field order of its sentences."""

    driver: str
    port: str  # a path, usb:VENDOR:PRODUCT[:SERIAL], or ask
    talker: str  # first word of the sentence, after the $
    columns: tuple[str, ...]  # field names after the talker; NEEDED must be among them
    # stuck_after: number of identical consecutive readings after which further ones are dropped as stuck
    stuck_after: Annotated[int, Within(2, 1_000_000)]

    def check(self) -> None:
        """Refuse unknown drivers and sentence formats without the required fields."""
        if self.driver not in DRIVERS:
            raise BadInput(
                f"backend.nose.driver={self.driver} was given, but it can be {', '.join(DRIVERS)}. Type backend.nose.driver=line."
            )
        missing = [name for name in NEEDED if name not in self.columns]
        if missing:
            raise BadInput(f"backend.nose.columns is {list(self.columns)}, but {missing[0]} is needed too. Type e.g. {list(NEEDED)}.")

    @property
    def least_s(self) -> float:
        """Shortest update period of the real part [s]; 0 if it has no limit."""
        return {"scd30": scd30.INTERVAL_S[0], "scd41": scd41.LEAST_S}.get(self.driver, 0.0)

    def live(self, sensor: Sensor, clock: Clock, mailbox: Mailbox) -> SerialDriver:
        """Create the driver for `sensor`. Raises BadInput if the driver does not fit the sensor."""
        bits = getattr(sensor, "adc_bits", None)
        if (self.driver == "line") != (bits is not None):
            suitable = "scd30 or scd41, which say ppm" if bits is None else "line, which says counts"
            raise BadInput(f"sensor={sensor.name} goes with {suitable}, but backend.nose.driver={self.driver} was given.")
        stuck_after = self.stuck_after if _noisy(sensor) else NEVER
        intake = ReadingFilter(mailbox, sensor.elements, sensor.highest_raw, stuck_after, getattr(sensor, "is_no_value", _never))
        if self.driver == "line":
            assert isinstance(bits, int)
            sentence = line.Sentence(self.talker, self.columns, "AB"[: sensor.elements], bits)
            return line.Line(intake, clock, sentence, sensor.sample_s)
        made = scd30.Scd30 if self.driver == "scd30" else scd41.Scd41
        return made(intake, clock, sensor.sample_s)


def _never(raw: float) -> bool:
    return False


def _noisy(sensor: Sensor) -> bool:
    """Whether the noise in clean air moves the raw value by one count or more: if not, a constant value is not a fault."""
    clean = sensor.raw(0.0)
    sigma_ppm = sensor.reading(GasSample(0, 0, clean)).sigma_ppm
    return abs(sensor.raw(sigma_ppm) - clean) >= 1.0
