"""Emulated Sensirion SCD41 (data sheet v1.7, April 2025) behind a SEK-SensorBridge: SHDLC at 460 800 baud.

New values come every `update_s` of the sensor's profile: 5 s for the real part.
"""

from hardware.codecs import scd4x, shdlc
from hardware.emulators.device import Electronics, Trouble

BRIDGE = 0x00
OK, UNKNOWN_COMMAND, WRONG_DATA = 0x00, 0x02, 0x04  # states; 02 and 04 are common to Sensirion's SHDLC devices
INFORMATION = {0: b"00070000\0", 1: b"SEK-SensorBridge\0", 2: b"1-101830-01\0", 3: b"EMULATED\0"}  # type, name, article, serial number
VERSION = bytes((1, 6, 0, 1, 0, 1, 0))  # firmware 1.6, no debug build, hardware 1.0, protocol 1.0
SERIAL = (0xF896, 0x9F07, 0x3BBE)  # the data sheet's example
VARIANT = 0x1440  # as read from a real SCD41
READY_BITS = 0x8006  # low 11 bits not zero; 0x8000 if no measurement is ready
STOP_S = 0.5  # busy after STOP
BUSY_S = {scd4x.SINGLE_SHOT: 5.0, scd4x.FORCED_RECALIBRATION: 0.4, scd4x.SELF_TEST: 10.0, scd4x.REINIT: 0.03}
FULL_PPM = 40_000.0
THINK_S = 0.001  # processing time: 1 ms for command and answer on I2C
DEGC, PCT_RH = 25.0, 50.0  # room conditions reported on this wire


class Scd41:
    """Emulated sensor at I2C address 0x62; None stands for a NACK."""

    def __init__(self, electronics: Electronics, update_s: float) -> None:
        self._electronics, self._update_s = electronics, update_s
        self._on, self._measures, self._t_s, self._busy_until_s, self._due_s = False, False, 0.0, 0.0, 0.0
        self._buffer: tuple[int, ...] = ()  # measurement that has not been read yet
        self._reply = b""

    def supply(self, on: bool) -> None:
        """Switch the supply; after switching on it is idle."""
        if on != self._on:
            self._on, self._measures, self._buffer, self._reply = on, False, (), b""

    def measure(self, t_s: float) -> None:
        """Measure if it is due at t_s."""
        self._t_s = t_s
        if self._measures and t_s >= self._due_s - 1e-9:
            self._due_s += self._update_s
            self._buffer = scd4x.words_measured(self._electronics.raw(0), DEGC, PCT_RH)

    def transfer(self, tx: bytes, rx_len: int) -> bytes | None:
        """I2C transfer: write, then read; either may be empty, as when the host waits in between."""
        if not self._on or self._t_s < self._busy_until_s:
            return None
        if tx:
            asked = scd4x.commanded(tx)
            words = None if asked is None else self._execute(asked[0])
            if words is None:
                return None
            self._reply = scd4x.packed(words)
        reply = self._reply[:rx_len]
        self._reply = self._reply[rx_len:]
        return reply if len(reply) == rx_len else None

    def _execute(self, command: int) -> tuple[int, ...] | None:
        """Execute a command; return the words of its reply."""
        if command == scd4x.READY:
            return (READY_BITS if self._buffer else 0x8000,)
        if command == scd4x.READ:
            words, self._buffer = self._buffer, ()
            return words or None
        if command == scd4x.STOP:
            self._measures, self._busy_until_s = False, self._t_s + STOP_S
            return ()
        if command == scd4x.PRESSURE:
            return ()
        return None if self._measures else self._execute_idle(command)

    def _execute_idle(self, command: int) -> tuple[int, ...] | None:
        """Execute a command that is accepted only while it does not measure."""
        self._busy_until_s = self._t_s + BUSY_S.get(command, 0.0)
        if command == scd4x.START:
            self._measures, self._due_s = True, self._t_s + self._update_s
        if command == scd4x.SINGLE_SHOT:
            self._buffer = scd4x.words_measured(self._electronics.raw(0), DEGC, PCT_RH)
        answers = {scd4x.SERIAL: SERIAL, scd4x.VARIANT: (VARIANT,), scd4x.SELF_TEST: (0,), scd4x.FORCED_RECALIBRATION: (0x8000,)}
        silent = (scd4x.START, scd4x.SINGLE_SHOT, scd4x.SELF_CALIBRATION, scd4x.REINIT)
        return () if command in silent else answers.get(command)


class SensorBridge:
    """Emulated bridge with one SCD41 at its first port."""

    baud, pause_s, boots_when_opened = 460_800, THINK_S, False

    def __init__(self, sensor: Scd41, trouble: Trouble) -> None:
        self._sensor, self._trouble, self._frames = sensor, trouble, shdlc.Mosi()

    def power_on(self, t_s: float) -> None:
        """Restart with the sensor's supply off."""
        self._frames = shdlc.Mosi()
        self._sensor.supply(False)

    def tick(self, t_s: float) -> bytes:
        """Advance the sensor; nothing is sent unsolicited."""
        self._sensor.measure(t_s)
        return b""

    def answer(self, data: bytes) -> bytes:
        """Return one frame per request addressed to the bridge."""
        return b"".join(self._execute(frame) for frame in self._frames.feed(data) if frame.address == BRIDGE)

    def _execute(self, frame: shdlc.Frame) -> bytes:
        state, data = self._run_command(frame.command, frame.data)
        return shdlc.miso(BRIDGE, frame.command, state, data)

    def _run_command(self, command: int, data: bytes) -> tuple[int, bytes]:
        """Execute a bridge command; return state and data of the reply."""
        if "nack" in self._trouble:
            return shdlc.NACK, b""
        if command == scd4x.TRANSCEIVE:
            return self._transceive(data)
        if command == scd4x.DEVICE_INFO:
            return (OK, INFORMATION[data[0]]) if len(data) == 1 and data[0] in INFORMATION else (WRONG_DATA, b"")
        if command == scd4x.VERSION:
            return OK, VERSION
        if command == scd4x.SUPPLY and len(data) == 2:
            self._sensor.supply(bool(data[1]))
        elif command == scd4x.I2C_SCAN:
            return OK, bytes((scd4x.ADDRESS,))
        elif command not in (scd4x.SET_VOLTAGE, scd4x.I2C_FREQUENCY):
            return UNKNOWN_COMMAND, b""
        return OK, b""

    def _transceive(self, data: bytes) -> tuple[int, bytes]:
        asked = scd4x.transfer(data)
        if asked is None:
            return WRONG_DATA, b""
        if asked.port != 0 or asked.i2c_address != scd4x.ADDRESS:
            return shdlc.NACK, b""
        reply = self._sensor.transfer(asked.tx, asked.rx_len)
        return (shdlc.NACK, b"") if reply is None else (OK, reply)
