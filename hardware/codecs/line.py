"""Codec of the line protocol of the nose's microcontroller and of the valve: sentences `$A,B*HH` one way, bare commands the other.

The frame is that of NMEA 0183: between $ and * printable ASCII, comma-separated fields; HH is the XOR of these characters, upper-case hex.
"""

import re
from functools import reduce
from operator import xor

from hardware.codecs.framing import Marked

LONGEST = 82  # characters of a sentence with its line end, as in NMEA 0183
LONGEST_COMMAND = 16  # characters

_PLAIN = rb"[ -#%-)+-~]"  # printable and neither $ nor *
_SENTENCE = re.compile(rb"\$(" + _PLAIN + rb"*)\*([0-9A-F]{2})\r")
_NO_FIELD = re.compile(r"[^ -#%-)+\--~]")  # characters not allowed in a field: as above, and the comma


def sentence(*fields: str) -> bytes:
    """Encode a sentence `$A,B*HH` with its line end. Raises ValueError."""
    text = ",".join(fields)
    line = f"${text}*{_checksum(text.encode('ascii')):02X}\r\n".encode("ascii")
    if not fields or any(_NO_FIELD.search(field) for field in fields) or len(line) > LONGEST:
        raise ValueError(f"{fields} is no sentence: at least one field, printable ASCII without $ * or comma, {LONGEST} characters in all")
    return line


def command(text: str) -> bytes:
    """Encode a command of the host. Raises ValueError."""
    if not 1 <= len(text) <= LONGEST_COMMAND or _NO_FIELD.search(text):
        raise ValueError(f"{text!r} is no command: 1 to {LONGEST_COMMAND} characters, printable ASCII without $ * or comma")
    return text.encode("ascii") + b"\n"


def _checksum(body: bytes) -> int:
    return reduce(xor, body, 0)


class Lines(Marked[tuple[str, ...]]):
    """Host side: decoder of sentences into fields. Every $ starts a new frame, so noise or a truncated sentence costs no other."""

    mark = b"\n"
    longest = LONGEST - 1

    def _frame_start(self, raw: bytes) -> bytes:
        starts, last = raw.count(b"$"), raw.rfind(b"$")
        start = raw[last:] if starts else b""
        self.corrupt += max(0, starts - 1)
        self.skipped += len(raw) - len(start)
        return start

    def _frame(self, raw: bytes) -> tuple[str, ...] | None:
        found = _SENTENCE.fullmatch(raw)
        if found is None or _checksum(found[1]) != int(found[2], 16):
            return None
        return tuple(found[1].decode("ascii").split(","))


class Commands(Marked[str]):
    """Device side: decoder of every line that is not empty, so that the device can refuse unknown commands.

    Characters that a sentence could not repeat are replaced by ?, and so is the end of an overlong command, lest a device execute the rest;
    no command has a question mark. Both count as corrupt. One \\r at the end is dropped.
    """

    mark = b"\n"
    longest = LONGEST_COMMAND + 1

    def _frame(self, raw: bytes) -> str:
        text = _NO_FIELD.sub("?", raw.removesuffix(b"\r").decode("latin-1"))
        return text if len(text) <= LONGEST_COMMAND else text[: LONGEST_COMMAND - 1] + "?"

    def _counted_frame(self, raw: bytes) -> str | None:
        line, text = raw.removesuffix(b"\r").decode("latin-1"), self._frame(raw)
        self.skipped += len(raw) - len(text)
        self.good += bool(line) and text == line
        self.corrupt += text != line
        return text or None
