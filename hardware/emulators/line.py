"""Emulated microcontrollers with the line protocol (hardware/firmware/nose), 115 200 baud: a nose of two ADC channels, and a valve."""

from collections.abc import Callable

from hardware.codecs.line import Commands, sentence
from hardware.emulators.device import Electronics, Trouble

NAME, VERSION = "OIO-NOSE", "1"  # as in the firmware
FIRST_PERIOD_MS = 100
PERIOD_MS = range(20, 10_001)
BOOT_S = 1.8  # duration of an Arduino's bootloader, which waits for a new program
CLOCK_JUMP_MS = 10_000
WRAP = 1 << 32  # milliseconds are uint32
HOLD_S = 10.0  # hold time of V1 and V2, as in the firmware's valve.h
SOURCES = {"V0": "none", "V1": "beacon", "V2": "source"}


class Board:
    """Base class of both boards: milliseconds since boot, acknowledgements, and command framing."""

    baud, pause_s, boots_when_opened = 115_200, 0.0, True

    def __init__(self, adc_bits: int, trouble: Trouble) -> None:
        self._bits, self._trouble, self._commands = adc_bits, trouble, Commands()
        self._t_s, self._booted_s = 0.0, 0.0

    @property
    def ms(self) -> int:
        """Milliseconds since boot on the board's clock; the fault `clock` sets it ahead."""
        ahead = CLOCK_JUMP_MS if "clock" in self._trouble else 0
        return (round(1e3 * (self._t_s - self._booted_s)) + ahead) % WRAP

    def power_on(self, t_s: float) -> None:
        """Reboot, as at each opening of its port."""
        self._t_s, self._booted_s, self._commands = t_s, t_s + BOOT_S, Commands()

    def tick(self, t_s: float) -> bytes:
        """Advance to t_s; nothing is sent unsolicited."""
        self._t_s = t_s
        return b""

    @property
    def awake(self) -> bool:
        """Whether the boot has finished."""
        return self._t_s >= self._booted_s - 1e-9

    def answer(self, data: bytes) -> bytes:
        """Return one sentence per command; nothing during the boot."""
        return b"".join(self._reply(command) for command in self._commands.feed(data)) if self.awake else b""

    def _reply(self, command: str) -> bytes:
        if "nack" in self._trouble:
            return sentence("NAK", command)
        if command == "ID":
            return sentence("ACK", "ID", NAME, VERSION, str(self._bits))
        return sentence("ACK", command, str(self.ms)) if self._execute(command) else sentence("NAK", command)

    def _execute(self, command: str) -> bool:
        return False


class LineNose(Board):
    """Emulated nose: `$NOSE,ms,active,adcA,adcB` every period. Its relays are not connected: the bench's valves are on another board."""

    def __init__(self, electronics: Electronics, elements: int, adc_bits: int, trouble: Trouble) -> None:
        super().__init__(adc_bits, trouble)
        self._electronics, self._elements = electronics, elements
        self._reset_settings()

    def _reset_settings(self) -> None:
        self._active, self._period_s = "A", 1e-3 * FIRST_PERIOD_MS
        self._due_s = self._booted_s + self._period_s

    def power_on(self, t_s: float) -> None:
        """Reboot with default settings."""
        super().power_on(t_s)
        self._reset_settings()

    def tick(self, t_s: float) -> bytes:
        """Return a frame if one is due, stamped at its conversion: at a tick, so a period that is no multiple of the tick has jitter."""
        super().tick(t_s)
        if t_s < self._due_s - 1e-9:
            return b""
        self._due_s += self._period_s
        if t_s >= self._due_s:
            self._due_s = t_s + self._period_s  # no burst after missed frames
        counts = [str(round(self._electronics.raw(i))) if i < self._elements else "0" for i in range(2)]
        return sentence("NOSE", str(self.ms), self._active, *counts)

    def _execute(self, command: str) -> bool:
        if command in ("SA", "SB"):
            self._active = command[1]
        elif command[0] == "P" and command[1:].isdecimal() and int(command[1:]) in PERIOD_MS:
            self._period_s = 1e-3 * int(command[1:])
            self._due_s = self._t_s + self._period_s
        else:
            return command in SOURCES
        return True


class Valve(Board):
    """Emulated valve of two relays (none, beacon, source); an open source closes hold_s [bench s] after the last command."""

    def __init__(self, present: Callable[[str], None], trouble: Trouble, hold_s: float = HOLD_S) -> None:
        super().__init__(10, trouble)  # ADC resolution of its ATmega328P
        self._present, self._hold_s, self._open, self._asked_s = present, hold_s, "none", 0.0

    def power_on(self, t_s: float) -> None:
        """Reboot with both sources closed."""
        super().power_on(t_s)
        self._open = "none"
        self._present("none")

    def tick(self, t_s: float) -> bytes:
        """Close the source after the hold time without a command, as the host may be dead; nothing is sent unsolicited."""
        if t_s - self._asked_s >= self._hold_s - 1e-9:
            self._switch("none")
        return super().tick(t_s)

    def _execute(self, command: str) -> bool:
        if command in SOURCES:
            self._asked_s = self._t_s
            self._switch(SOURCES[command])
        return command in SOURCES

    def _switch(self, source: str) -> None:
        if source != self._open:  # a repeated command does not switch the relay
            self._open = source
            self._present(source)
