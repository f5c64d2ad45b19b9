"""Codec of the Feetech STS servo bus (1 Mbaud, 8N1, half duplex), little-endian: `FF FF id length code parameters checksum`.

The length counts code, parameters and checksum; the checksum is the inverted sum of all bytes after FF FF. The code is the instruction, or
in a reply the error bits. Format: feetech-servo-sdk 1.0.0 (Unlicense); registers: Feetech's STS3215 memory table by way of lerobot
(Apache-2.0) motors/feetech/tables.py.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from hardware.codecs.framing import Sized

PING, READ, WRITE, SYNC_READ, SYNC_WRITE = 0x01, 0x02, 0x03, 0x82, 0x83
BROADCAST = 0xFE
MOST_PARAMS = 248  # bytes; the vendor's SDK refuses packets whose length is above 250
VOLTAGE_ERROR, ANGLE_ERROR, OVERHEAT, OVERCURRENT, OVERLOAD = 1, 2, 4, 8, 32  # error bits

STS3215_MODEL = 777
TICKS_PER_TURN = 4096


class Register(NamedTuple):
    """Address and length of a value in a servo's memory."""

    address: int
    length: int  # bytes


# EPROM: written only after LOCK <- 0
MODEL = Register(3, 2)
ID = Register(5, 1)
BAUD = Register(6, 1)  # 0: 1 M, 1: 500 k, 2: 250 k, 3: 128 k, 4: 115 200
RETURN_DELAY = Register(7, 1)  # 2 us
MIN_POSITION = Register(9, 2)  # tick
MAX_POSITION = Register(11, 2)  # tick
MAX_TEMPERATURE = Register(13, 1)  # degC
P, D, I = Register(21, 1), Register(22, 1), Register(23, 1)
HOMING_OFFSET = Register(31, 2)  # tick, sign bit 11
MODE = Register(33, 1)  # 0: position, 1: velocity, 2: PWM, 3: step
# SRAM
TORQUE_ENABLE = Register(40, 1)  # 0 or 1
ACCELERATION = Register(41, 1)
GOAL_POSITION = Register(42, 2)  # tick, sign bit 15
GOAL_VELOCITY = Register(46, 2)  # sign bit 15; the public sources disagree on its unit
TORQUE_LIMIT = Register(48, 2)  # 0.1 %
LOCK = Register(55, 1)  # 0: EPROM can be written
PRESENT_POSITION = Register(56, 2)  # tick, sign bit 15
PRESENT_VELOCITY = Register(58, 2)  # sign bit 15; unit as GOAL_VELOCITY
PRESENT_LOAD = Register(60, 2)  # 0.1 % of the largest torque (unchecked), sign bit 10
PRESENT_VOLTAGE = Register(62, 1)  # 0.1 V
PRESENT_TEMPERATURE = Register(63, 1)  # degC
STATUS = Register(65, 1)  # the error bits
MOVING = Register(66, 1)  # 0 or 1
PRESENT_CURRENT = Register(69, 2)  # 6.5 mA (unchecked), sign bit 15


@dataclass(frozen=True, slots=True)
class Packet:
    """One packet, in either direction: `code` is the instruction from the host, the error bits from a servo."""

    id: int
    code: int
    params: bytes


def instruction(id: int, ins: int, params: bytes = b"") -> bytes:
    """Encode an instruction packet of the host; with error bits for `ins`, a status packet of a servo. Raises ValueError."""
    if id > BROADCAST or len(params) > MOST_PARAMS:
        raise ValueError(f"an id is at most {BROADCAST} and parameters at most {MOST_PARAMS} bytes, not {id} and {len(params)}")
    body = bytes((id, len(params) + 2, ins)) + params
    return b"\xff\xff" + body + bytes((~sum(body) & 0xFF,))


def status(id: int, error: int, params: bytes = b"") -> bytes:
    """Encode a status packet of a servo."""
    return instruction(id, error, params)


def ping(id: int) -> bytes:
    return instruction(id, PING)


def read(id: int, address: int, length: int) -> bytes:
    return instruction(id, READ, bytes((address, length)))


def write(id: int, address: int, data: bytes) -> bytes:
    return instruction(id, WRITE, bytes((address,)) + data)


def sync_read(address: int, length: int, ids: Iterable[int]) -> bytes:
    """Encode a read of all `ids` at once; they reply one after the other in this order."""
    return instruction(BROADCAST, SYNC_READ, bytes((address, length, *ids)))


def sync_write(address: int, data: Mapping[int, bytes]) -> bytes:
    """Encode a write of each id's own bytes at the same address; no servo replies."""
    (length,) = {len(each) for each in data.values()}
    return instruction(BROADCAST, SYNC_WRITE, bytes((address, length)) + b"".join(bytes((id,)) + each for id, each in data.items()))


def signed(raw: int, bit: int) -> int:
    """Decode a sign-and-magnitude word with the sign at `bit`."""
    size = raw & (1 << bit) - 1
    return -size if raw >> bit & 1 else size


def magnitude(value: int, bit: int) -> int:
    """Encode a value in sign and magnitude; inverse of `signed`. Raises ValueError."""
    if abs(value) >= 1 << bit:
        raise ValueError(f"{value} does not fit into {bit} bits and a sign")
    return -value | 1 << bit if value < 0 else value


class Packets(Sized[Packet]):
    """Decoder of packets in either direction."""

    head = re.compile(rb"\xff\xff[\x00-\xfe][\x02-\xfa]")  # FF is not a valid id: a third FF shifts the head by one
    width = 4

    def _size(self, head: bytes) -> int:
        return 4 + head[3]

    def _frame(self, raw: bytes) -> Packet | None:
        return Packet(raw[2], raw[4], raw[5:-1]) if sum(raw[2:]) & 0xFF == 0xFF else None
