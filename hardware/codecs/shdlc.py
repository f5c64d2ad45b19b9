"""Codec of SHDLC, the serial frames of Sensirion's SEK-SensorBridge (460 800 baud, 8N1).

Host to device `7E address command length data checksum 7E`, back `7E address command state length data checksum 7E`; the checksum is the
inverted sum; 7E, 7D, 11 and 13 within are escaped as 7D and the byte with bit 5 inverted (Sensirion, sensirion-shdlc-driver, BSD-3, for
the format).
"""

import re
from dataclasses import dataclass

from hardware.codecs.framing import Marked

FLAG, ESCAPE, TURN = b"\x7e", 0x7D, 0x20
NACK, I2C_TIMEOUT = 0x29, 0x2B  # states of the SensorBridge: no acknowledgement on I2C, I2C time-out

_RESERVED = re.compile(rb"[\x7e\x7d\x11\x13]")
_ESCAPED = re.compile(rb"\x7d(.)", re.DOTALL)


@dataclass(frozen=True, slots=True)
class Frame:
    """One frame, in either direction; the state of a frame from the host is 0."""

    address: int
    command: int
    state: int
    data: bytes


def mosi(address: int, command: int, data: bytes = b"") -> bytes:
    """Encode a frame from the host (master out, slave in)."""
    return _enclosed(bytes((address, command, len(data))) + data)


def miso(address: int, command: int, state: int, data: bytes = b"") -> bytes:
    """Encode a frame from the device (master in, slave out)."""
    return _enclosed(bytes((address, command, state, len(data))) + data)


def _enclosed(content: bytes) -> bytes:
    content += bytes((~sum(content) & 0xFF,))
    return FLAG + _RESERVED.sub(lambda found: bytes((ESCAPE, found[0][0] ^ TURN)), content) + FLAG


def _content(raw: bytes, head: int) -> bytes | None:
    """Unescape a frame's content and drop the checksum; None if length, checksum or escapes are wrong. `head`: bytes before the data."""
    content = _ESCAPED.sub(lambda found: bytes((found[1][0] ^ TURN,)), raw)[:-1]
    whole = len(content) >= head and len(content) == head + content[head - 1]
    return content if whole and _enclosed(content)[1:-1] == raw else None


class _Frames(Marked[Frame]):
    """Every flag ends the bytes before it and may begin a frame, so a lost flag costs at most the frame that lost it."""

    mark = FLAG


class Miso(_Frames):
    """Host side: decoder of frames from the device."""

    longest = 2 * (4 + 255 + 1)  # bytes if all are escaped

    def _frame(self, raw: bytes) -> Frame | None:
        content = _content(raw, 4)
        return None if content is None else Frame(content[0], content[1], content[2], content[4:])


class Mosi(_Frames):
    """Device side: decoder of frames from the host."""

    longest = 2 * (3 + 255 + 1)

    def _frame(self, raw: bytes) -> Frame | None:
        content = _content(raw, 3)
        return None if content is None else Frame(content[0], content[1], 0, content[3:])
