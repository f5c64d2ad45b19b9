"""Emulated Sensirion SCD30 as a Modbus slave (interface description v1.0, May 2020): 19 200 baud, address 0x61.

New values come every `update_s` of the sensor's profile, whatever the interval register holds: profile=paper is faster than any real part.
"""

from hardware.codecs import modbus
from hardware.emulators.device import Electronics, Trouble

ADDRESS = 0x61
FIRMWARE, INTERVAL, READY, VALUES, RESET, START, STOP = 0x20, 0x25, 0x27, 0x28, 0x34, 0x36, 0x37
ALTITUDE, RECALIBRATION, SELF_CALIBRATION, TEMPERATURE_OFFSET = 0x38, 0x39, 0x3A, 0x3B
SETTINGS = {  # register: range of values that may be written
    INTERVAL: (2, 1800),
    RESET: (1, 1),
    START: (0, 1400),
    STOP: (1, 1),
    ALTITUDE: (0, 0xFFFF),
    RECALIBRATION: (400, 2000),
    SELF_CALIBRATION: (0, 1),
    TEMPERATURE_OFFSET: (0, 0xFFFF),
}
VERSION_3_66 = 0x0342  # a firmware of 2019
FULL_PPM = 40_000.0
BOOT_S = 2.0  # data sheet: maximum
THINK_S = 0.003  # assumption: at least the 3.5 characters of silence that end a Modbus frame take 1.8 ms
DEGC, PCT_RH = 25.0, 50.0  # room conditions reported on this wire


class Scd30:
    """Registers of the SCD30, and a measurement when one is due."""

    baud, pause_s, boots_when_opened = 19_200, THINK_S, False

    def __init__(self, electronics: Electronics, update_s: float, trouble: Trouble) -> None:
        self._electronics, self._update_s, self._trouble = electronics, update_s, trouble
        self._requests = modbus.Requests(ADDRESS)
        self._words = dict.fromkeys(SETTINGS, 0) | {FIRMWARE: VERSION_3_66, INTERVAL: 2, READY: 0, RECALIBRATION: 400}
        self._words |= dict.fromkeys(range(VALUES, VALUES + 6), 0)
        self._t_s, self._booted_s, self._due_s = 0.0, 0.0, update_s
        self._measures = True  # retained over power-up; taken as on: a part that was used before

    def power_on(self, t_s: float) -> None:
        """Reboot; the settings and whether it measures are retained."""
        self._t_s, self._booted_s, self._due_s = t_s, t_s + BOOT_S, t_s + BOOT_S + self._update_s
        self._requests, self._words[READY] = modbus.Requests(ADDRESS), 0

    def tick(self, t_s: float) -> bytes:
        """Measure if it is due; nothing is sent unsolicited."""
        self._t_s = t_s
        if self._measures and t_s >= self._due_s - 1e-9:
            self._due_s += self._update_s
            values = modbus.words_of((self._electronics.raw(0), DEGC, PCT_RH))
            self._words |= dict(zip(range(VALUES, VALUES + 6), values, strict=True)) | {READY: 1}
        return b""

    def answer(self, data: bytes) -> bytes:
        """Return replies and exception responses; nothing during the boot."""
        requests = self._requests.feed(data)
        return b"" if self._t_s < self._booted_s else b"".join(self._execute(request) for request in requests)

    def _execute(self, request: modbus.Request) -> bytes:
        if "nack" in self._trouble:
            return modbus.refusal(ADDRESS, request.function, modbus.DEVICE_FAILURE)
        if request.function == modbus.WRITE:
            return self._write(request.register, request.value)
        registers = range(request.register, request.register + request.value)
        if not 1 <= len(registers) <= modbus.MOST_WORDS or any(register not in self._words for register in registers):
            return modbus.refusal(ADDRESS, request.function, modbus.ILLEGAL_ADDRESS)
        reply = modbus.read_reply(ADDRESS, request.function, [self._words[register] for register in registers])
        if VALUES in registers:
            self._words[READY] = 0
        return reply

    def _write(self, register: int, value: int) -> bytes:
        if register not in SETTINGS:
            return modbus.refusal(ADDRESS, modbus.WRITE, modbus.ILLEGAL_ADDRESS)
        low, high = SETTINGS[register]
        if not low <= value <= high:
            return modbus.refusal(ADDRESS, modbus.WRITE, modbus.ILLEGAL_VALUE)
        self._words[register] = value
        self._act(register)
        return modbus.write_reply(ADDRESS, register, value)

    def _act(self, register: int) -> None:
        if register == RESET:
            self.power_on(self._t_s)
        elif register == STOP:
            self._measures = False
        elif register == START and not self._measures:
            self._measures, self._due_s = True, self._t_s + self._update_s
