"""Microcontrollers that speak the line protocol (hardware/firmware/nose), 115 200 baud: a nose of two ADC channels, and a valve."""

from collections.abc import Callable

from hardware.codecs.line import Commands, sentence
from hardware.emulators.device import Electronics, Trouble

NAME, VERSION = "OIO-NOSE", "1"  # as the firmware says
FIRST_PERIOD_MS = 100
PERIOD_MS = range(20, 10_001)
BOOT_S = 1.8  # an Arduino's bootloader waits so long for a new program
CLOCK_JUMP_MS = 10_000
WRAP = 1 << 32  # ms are uint32
HOLD_S = 10.0  # V1 and V2 hold so long, as in the firmware's valve.h
SOURCES = {"V0": "none", "V1": "beacon", "V2": "source"}


class Board:
    """What both have: milliseconds since boot, acknowledgements, and what it takes for a command."""

    baud, pause_s, boots_when_opened = 115_200, 0.0, True

    def __init__(self, adc_bits: int, trouble: Trouble) -> None:
        self._bits, self._trouble, self._commands = adc_bits, trouble, Commands()
        self._t_s, self._booted_s = 0.0, 0.0

    @property
    def ms(self) -> int:
        """As its own clock has it; in trouble that clock is ahead."""
        ahead = CLOCK_JUMP_MS if "clock" in self._trouble else 0
        return (round(1e3 * (self._t_s - self._booted_s)) + ahead) % WRAP

    def powered(self, t_s: float) -> None:
        """It boots, as it does whenever somebody opens its port."""
        self._t_s, self._booted_s, self._commands = t_s, t_s + BOOT_S, Commands()

    def spoken(self, t_s: float) -> bytes:
        """Nothing unasked."""
        self._t_s = t_s
        return b""

    @property
    def awake(self) -> bool:
        """Whether it has booted."""
        return self._t_s >= self._booted_s - 1e-9

    def answer(self, data: bytes) -> bytes:
        """One sentence for each command."""
        return b"".join(self._told(command) for command in self._commands.feed(data)) if self.awake else b""

    def _told(self, command: str) -> bytes:
        if "nack" in self._trouble:
            return sentence("NAK", command)
        if command == "ID":
            return sentence("ACK", "ID", NAME, VERSION, str(self._bits))
        return sentence("ACK", command, str(self.ms)) if self._obeyed(command) else sentence("NAK", command)

    def _obeyed(self, command: str) -> bool:
        return False


class LineNose(Board):
    """`$NOSE,ms,active,adcA,adcB` every period. Its relays are wired to nothing: the bench's valves are another board's."""

    def __init__(self, electronics: Electronics, elements: int, adc_bits: int, trouble: Trouble) -> None:
        super().__init__(adc_bits, trouble)
        self._electronics, self._elements = electronics, elements
        self._begin()

    def _begin(self) -> None:
        self._active, self._period_s = "A", 1e-3 * FIRST_PERIOD_MS
        self._due_s = self._booted_s + self._period_s

    def powered(self, t_s: float) -> None:
        """It boots."""
        super().powered(t_s)
        self._begin()

    def spoken(self, t_s: float) -> bytes:
        """A frame, if one is due; stamped when its values were taken: at a tick, so a period that is no multiple of it is uneven."""
        super().spoken(t_s)
        if t_s < self._due_s - 1e-9:
            return b""
        self._due_s += self._period_s
        if t_s >= self._due_s:
            self._due_s = t_s + self._period_s  # no burst to make up for what was missed
        counts = [str(round(self._electronics.raw(i))) if i < self._elements else "0" for i in range(2)]
        return sentence("NOSE", str(self.ms), self._active, *counts)

    def _obeyed(self, command: str) -> bool:
        if command in ("SA", "SB"):
            self._active = command[1]
        elif command[0] == "P" and command[1:].isdecimal() and int(command[1:]) in PERIOD_MS:
            self._period_s = 1e-3 * int(command[1:])
            self._due_s = self._t_s + self._period_s
        else:
            return command in SOURCES
        return True


class Valve(Board):
    """Two relays: no gas, the beacon's, or the source's; these for ten seconds of the bench after they were last asked for."""

    def __init__(self, present: Callable[[str], None], trouble: Trouble, hold_s: float = HOLD_S) -> None:
        super().__init__(10, trouble)  # the ADC of its ATmega328P
        self._present, self._hold_s, self._open, self._asked_s = present, hold_s, "none", 0.0

    def powered(self, t_s: float) -> None:
        """It boots with its relays open."""
        super().powered(t_s)
        self._open = "none"
        self._present("none")

    def spoken(self, t_s: float) -> bytes:
        """Nothing; but whoever opened the gas may be dead."""
        if t_s - self._asked_s >= self._hold_s - 1e-9:
            self._switch("none")
        return super().spoken(t_s)

    def _obeyed(self, command: str) -> bool:
        if command in SOURCES:
            self._asked_s = self._t_s
            self._switch(SOURCES[command])
        return command in SOURCES

    def _switch(self, source: str) -> None:
        if source != self._open:  # a repetition does not click
            self._open = source
            self._present(source)
