"""Codec of Dynamixel protocol 2.0 (57 600 baud by default, 8N1, half duplex), little-endian: `FF FF FD 00 id length instruction .. CRC`.

The length (2 bytes) counts instruction, parameters and CRC; in a reply the instruction is 55 and an error byte precedes the parameters.
FF FF FD within a packet is stuffed to FF FF FD FD. Format: ROBOTIS e-Manual, Protocol 2.0; registers: X series control table, by way of
lerobot (Apache-2.0) motors/dynamixel/tables.py.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from hardware.codecs.framing import Sized

PING, READ, WRITE, STATUS, SYNC_READ, SYNC_WRITE = 0x01, 0x02, 0x03, 0x55, 0x82, 0x83
BROADCAST = 0xFE
ALERT = 0x80  # bit of the error byte: the servo has a hardware error; the bits below number the fault of the packet
LONGEST = 1024  # bytes of a whole packet, the limit of the vendor's SDK
TICKS_PER_TURN = 4096

_HEAD = b"\xff\xff\xfd\x00"
_PLAIN, _STUFFED = b"\xff\xff\xfd", b"\xff\xff\xfd\xfd"


class Register(NamedTuple):
    """Address and length of a value in a servo's control table."""

    address: int
    length: int  # bytes


MODEL = Register(0, 2)
ID = Register(7, 1)
BAUD = Register(8, 1)  # 1: 57 600, 3: 1 M, 4: 2 M
RETURN_DELAY = Register(9, 1)  # 2 us
OPERATING_MODE = Register(11, 1)  # 3: position
HOMING_OFFSET = Register(20, 4)  # tick
MAX_POSITION = Register(48, 4)  # tick
MIN_POSITION = Register(52, 4)  # tick
TORQUE_ENABLE = Register(64, 1)  # 0 or 1
HARDWARE_ERROR = Register(70, 1)  # bits: 0 voltage, 2 overheating, 3 encoder, 4 shock, 5 overload
GOAL_CURRENT = Register(102, 2)
GOAL_VELOCITY = Register(104, 4)  # 0.229 rev/min
PROFILE_ACCELERATION = Register(108, 4)
PROFILE_VELOCITY = Register(112, 4)  # 0.229 rev/min
GOAL_POSITION = Register(116, 4)  # tick
PRESENT_CURRENT = Register(126, 2)
PRESENT_VELOCITY = Register(128, 4)  # 0.229 rev/min
PRESENT_POSITION = Register(132, 4)  # tick; signed, two's complement as all here
PRESENT_VOLTAGE = Register(144, 2)  # 0.1 V
PRESENT_TEMPERATURE = Register(146, 1)  # degC


def _shifted(high: int) -> int:
    crc = high << 8
    for _ in range(8):
        crc = (crc << 1 ^ (0x8005 if crc & 0x8000 else 0)) & 0xFFFF
    return crc


_TABLE = tuple(_shifted(high) for high in range(256))


@dataclass(frozen=True, slots=True)
class Packet:
    """One packet, in either direction; `error` is 0 in one from the host."""

    id: int
    instruction: int
    error: int
    params: bytes


def crc16(data: bytes) -> int:
    """CRC-16, polynomial 0x8005 not reflected, initial value 0; sent low byte first."""
    crc = 0
    for byte in data:
        crc = crc << 8 & 0xFFFF ^ _TABLE[crc >> 8 ^ byte]
    return crc


def instruction(id: int, ins: int, params: bytes = b"") -> bytes:
    """Encode an instruction packet of the host."""
    body = (bytes((ins,)) + params).replace(_PLAIN, _STUFFED)
    packet = _HEAD + bytes((id,)) + (len(body) + 2).to_bytes(2, "little") + body
    if id in (0xFD, 0xFF) or len(packet) + 2 > LONGEST:
        raise ValueError(f"an id is at most 252 or {BROADCAST} and a packet at most {LONGEST} bytes, not {id} and {len(packet) + 2}")
    return packet + crc16(packet).to_bytes(2, "little")


def status(id: int, error: int, params: bytes = b"") -> bytes:
    """Encode a status packet of a servo."""
    return instruction(id, STATUS, bytes((error,)) + params)


def ping(id: int) -> bytes:
    return instruction(id, PING)


def read(id: int, address: int, length: int) -> bytes:
    return instruction(id, READ, _words(address, length))


def write(id: int, address: int, data: bytes) -> bytes:
    return instruction(id, WRITE, _words(address) + data)


def sync_read(address: int, length: int, ids: Iterable[int]) -> bytes:
    """Encode a read of all `ids` at once; they reply one after the other in this order."""
    return instruction(BROADCAST, SYNC_READ, _words(address, length) + bytes(ids))


def sync_write(address: int, data: Mapping[int, bytes]) -> bytes:
    """Encode a write of each id's own bytes at the same address; no servo replies."""
    (length,) = {len(each) for each in data.values()}
    body = b"".join(bytes((id,)) + each for id, each in data.items())
    return instruction(BROADCAST, SYNC_WRITE, _words(address, length) + body)


def _words(*words: int) -> bytes:
    return b"".join(word.to_bytes(2, "little") for word in words)


class Packets(Sized[Packet]):
    """Decoder of packets in either direction."""

    head = re.compile(rb"\xff\xff\xfd\x00[\x00-\xfc\xfe].[\x00-\x03]", re.DOTALL)
    width = 7

    def _size(self, head: bytes) -> int:
        size = 7 + int.from_bytes(head[5:7], "little")
        return size if 10 <= size <= LONGEST else 0

    def _frame(self, raw: bytes) -> Packet | None:
        if crc16(raw[:-2]) != int.from_bytes(raw[-2:], "little"):
            return None
        body = raw[7:-2].replace(_STUFFED, _PLAIN)
        if body.replace(_PLAIN, _STUFFED) != raw[7:-2]:  # unstuffed head within the packet
            return None
        if body[0] != STATUS:
            return Packet(raw[4], body[0], 0, body[1:])
        return Packet(raw[4], STATUS, body[1], body[2:]) if len(body) > 1 else None
