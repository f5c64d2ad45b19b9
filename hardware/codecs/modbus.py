"""Codec of Modbus RTU, as far as a sensor needs it: read holding (3) or input (4) registers, write single register (6).

Modbus over Serial Line V1.02 and Application Protocol V1.1b3 (modbus.org); the SCD30's use of it: Sensirion, SCD30 interface
description, May 2020.
"""

import re
import struct
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from hardware.codecs.framing import Sized

HOLDING, INPUT, WRITE = 3, 4, 6
REFUSED = 0x80  # exception bit, added to the function code
ILLEGAL_FUNCTION, ILLEGAL_ADDRESS, ILLEGAL_VALUE, DEVICE_FAILURE, DEVICE_BUSY = 1, 2, 3, 4, 6  # V1.1b3, section 7
MOST_WORDS = 125  # largest number of registers of one read, V1.1b3, section 6.3

_COUNTS = re.escape(bytes(range(2, 2 * MOST_WORDS + 1, 2)))  # valid byte counts of a read response


def _shifted(byte: int) -> int:
    for _ in range(8):
        byte = byte >> 1 ^ (0xA001 if byte & 1 else 0)
    return byte


_TABLE = tuple(_shifted(byte) for byte in range(256))


@dataclass(frozen=True, slots=True)
class Reply:
    """Normal response of a device: the words of a read, or (register, value) of a write."""

    function: int
    words: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class ExceptionResponse:
    """Exception response: `function` is the one requested, `code` the reason (1 function, 2 register, 3 value, 4 failure, 6 busy)."""

    function: int
    code: int


@dataclass(frozen=True, slots=True)
class Request:
    """Request of a host: `value` is the number of registers of a read, or the word of a write."""

    function: int
    register: int
    value: int


def crc16(data: bytes) -> int:
    """CRC-16/MODBUS: polynomial 0x8005 reflected, initial value 0xFFFF; sent low byte first."""
    crc = 0xFFFF
    for byte in data:
        crc = crc >> 8 ^ _TABLE[(crc ^ byte) & 0xFF]
    return crc


def _with_crc(body: bytes) -> bytes:
    return body + crc16(body).to_bytes(2, "little")


def _intact(raw: bytes) -> bool:
    return crc16(raw[:-2]) == int.from_bytes(raw[-2:], "little")


def read_request(address: int, register: int, count: int, function: int = HOLDING) -> bytes:
    return _with_crc(struct.pack(">BBHH", address, function, register, count))


def write_request(address: int, register: int, value: int) -> bytes:
    return _with_crc(struct.pack(">BBHH", address, WRITE, register, value))


def read_reply(address: int, function: int, words: Sequence[int]) -> bytes:
    if not 1 <= len(words) <= MOST_WORDS:
        raise ValueError(f"a read reply holds 1 to {MOST_WORDS} words, not {len(words)}")
    return _with_crc(struct.pack(f">BBB{len(words)}H", address, function, 2 * len(words), *words))


def write_reply(address: int, register: int, value: int) -> bytes:
    return write_request(address, register, value)  # a device repeats the request, V1.1b3, section 6.6


def refusal(address: int, function: int, code: int) -> bytes:
    return _with_crc(bytes((address, function | REFUSED, code)))


def floats(words: Sequence[int]) -> tuple[float, ...]:
    """Decode float32 values, two words each, most significant word first (SCD30 interface description, section 1.5)."""
    return struct.unpack(f">{len(words) // 2}f", struct.pack(f">{len(words)}H", *words))


def words_of(values: Iterable[float]) -> tuple[int, ...]:
    """Encode float32 values as words; inverse of `floats`."""
    packed = b"".join(struct.pack(">f", value) for value in values)
    return struct.unpack(f">{len(packed) // 2}H", packed)


class Replies(Sized[Reply | ExceptionResponse]):
    """Host side: decoder of the responses of the device with one address."""

    width = 3

    def __init__(self, address: int) -> None:
        super().__init__()
        self.head = re.compile(re.escape(bytes((address,))) + rb"(?:[\x03\x04][" + _COUNTS + rb"]|[\x06\x83\x84\x86].)", re.DOTALL)

    def _size(self, head: bytes) -> int:
        function = head[1]
        return 5 if function & REFUSED else 8 if function == WRITE else 5 + head[2]

    def _frame(self, raw: bytes) -> Reply | ExceptionResponse | None:
        if not _intact(raw):
            return None
        if raw[1] & REFUSED:
            return ExceptionResponse(raw[1] & ~REFUSED, raw[2])
        words = raw[2:-2] if raw[1] == WRITE else raw[3:-2]
        return Reply(raw[1], struct.unpack(f">{len(words) // 2}H", words))


class Requests(Sized[Request]):
    """Device side: decoder of the requests to the device with one address."""

    width = 2

    def __init__(self, address: int) -> None:
        super().__init__()
        self.head = re.compile(re.escape(bytes((address,))) + rb"[\x03\x04\x06]")

    def _size(self, head: bytes) -> int:
        return 8

    def _frame(self, raw: bytes) -> Request | None:
        return Request(*struct.unpack(">BHH", raw[1:-2])) if _intact(raw) else None
