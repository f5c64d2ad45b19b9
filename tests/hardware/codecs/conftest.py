"""Every framer with frames it can read, for the laws that hold for all of them."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from hypothesis import strategies as st

from hardware.codecs import dynamixel, line, modbus, shdlc, sts
from hardware.codecs.framing import Framer, Sized

SCD30 = 0x61


@dataclass(frozen=True, kw_only=True)
class Codec:
    name: str
    framer: Callable[[], Framer[Any]]
    encode: Callable[[Any], bytes]  # the only bytes that read as this frame
    frames: st.SearchStrategy[Any]
    example: Any
    heads: tuple[bytes, ...]  # what noise must contain to be dangerous
    fake: Callable[[bytes], bytes]  # the head of a frame and right lengths; content and check are the random bytes
    fake_odds: float  # that a fake passes
    head: re.Pattern[bytes]  # where random bytes may be taken for a frame,
    odds: float  # and how probably
    longest: int  # bytes
    loose: frozenset[int] = frozenset()  # bytes whose change moves the end of the frame, so that the check promises nothing for sure

    def __repr__(self) -> str:
        return self.name

    def noise(self) -> st.SearchStrategy[bytes]:
        """Random bytes, heads, and frames cut short at either end."""
        raw = self.encode(self.example)
        tokens = (*self.heads, *(raw[:at] for at in range(1, len(raw))), *(raw[at:] for at in range(1, len(raw))))
        return st.lists(st.sampled_from(tokens) | st.binary(max_size=6), max_size=4).map(b"".join)


def of_reply(frame: modbus.Reply | modbus.ExceptionResponse) -> bytes:
    if isinstance(frame, modbus.ExceptionResponse):
        return modbus.refusal(SCD30, frame.function, frame.code)
    if frame.function == modbus.WRITE:
        return modbus.write_reply(SCD30, *frame.words)
    return modbus.read_reply(SCD30, frame.function, frame.words)


def of_request(frame: modbus.Request) -> bytes:
    if frame.function == modbus.WRITE:
        return modbus.write_request(SCD30, frame.register, frame.value)
    return modbus.read_request(SCD30, frame.register, frame.value, frame.function)


def of_dynamixel(frame: dynamixel.Packet) -> bytes:
    if frame.instruction == dynamixel.STATUS:
        return dynamixel.status(frame.id, frame.error, frame.params)
    return dynamixel.instruction(frame.id, frame.instruction, frame.params)


def stuffed(content: bytes) -> bytes:
    return re.sub(rb"[\x7e\x7d\x11\x13]", lambda found: bytes((0x7D, found[0][0] ^ 0x20)), content)


def fake_line(rnd: bytes) -> bytes:
    return b"$" + bytes(b"0123456789ABCDEF,NOSE."[byte % 22] for byte in rnd[2:]) + b"*%X%X\r\n" % (rnd[0] & 15, rnd[1] & 15)


BYTE, WORD, IDS = st.integers(0, 255), st.integers(0, 65535), st.integers(0, 252)
READS = st.builds(modbus.Reply, st.sampled_from((3, 4)), st.lists(WORD, min_size=1, max_size=12).map(tuple))
WRITES = st.builds(modbus.Reply, st.just(6), st.tuples(WORD, WORD))
REFUSALS = st.builds(modbus.ExceptionResponse, st.sampled_from((3, 4, 6)), BYTE)
DATA = st.binary(max_size=20) | st.lists(st.sampled_from((0x7E, 0x7D, 0x11, 0x13, 0xFF, 0xFD, 0x00)), max_size=20).map(bytes)
FIELDS = st.lists(st.text(st.characters(min_codepoint=32, max_codepoint=126, exclude_characters="$*,"), max_size=8), min_size=1, max_size=7)
FROM_HOST = st.builds(dynamixel.Packet, IDS | st.just(254), BYTE.filter(lambda code: code != 0x55), st.just(0), DATA)
FROM_SERVO = st.builds(dynamixel.Packet, IDS, st.just(0x55), BYTE, DATA)

CODECS = (
    Codec(
        name="modbus replies",
        framer=lambda: modbus.Replies(SCD30),
        encode=of_reply,
        frames=READS | WRITES | REFUSALS,
        example=modbus.Reply(3, (0x43DB, 0x8C2E)),
        heads=(b"\x61", b"\x61\x03\x0c", b"\x61\x04\xfa", b"\x61\x83"),
        fake=lambda rnd: b"\x61\x03" + bytes(((len(rnd) - 2) & 0xFE,)) + rnd[len(rnd) & 1 :],
        fake_odds=2**-16,
        head=modbus.Replies(SCD30).head,
        odds=2**-16,
        longest=255,
        loose=frozenset((1, 2)),
    ),
    Codec(
        name="modbus requests",
        framer=lambda: modbus.Requests(SCD30),
        encode=of_request,
        frames=st.builds(modbus.Request, st.sampled_from((3, 4, 6)), WORD, WORD),
        example=modbus.Request(3, 0x28, 6),
        heads=(b"\x61", b"\x61\x03", b"\x61\x06\x00"),
        fake=lambda rnd: b"\x61\x03" + rnd[:6],
        fake_odds=2**-16,
        head=modbus.Requests(SCD30).head,
        odds=2**-16,
        longest=8,
    ),
    Codec(
        name="shdlc miso",
        framer=shdlc.Miso,
        encode=lambda frame: shdlc.miso(frame.address, frame.command, frame.state, frame.data),
        frames=st.builds(shdlc.Frame, BYTE, BYTE, BYTE, DATA),
        example=shdlc.Frame(0, 0x11, 0, b"\x01\xf4\x33\x7e"),
        heads=(b"\x7e", b"\x7d", b"\x7e\x00\x11\x00", b"\x7e\x00\x11\x00\x40"),
        fake=lambda rnd: b"\x7e" + stuffed(rnd[:3] + bytes((len(rnd) - 4,)) + rnd[3:]) + b"\x7e",
        fake_odds=2**-8,
        head=re.compile(b"\x7e"),
        odds=2**-16,
        longest=520,
    ),
    Codec(
        name="shdlc mosi",
        framer=shdlc.Mosi,
        encode=lambda frame: shdlc.mosi(frame.address, frame.command, frame.data),
        frames=st.builds(shdlc.Frame, BYTE, BYTE, st.just(0), DATA),
        example=shdlc.Frame(0, 0x11, 0, b"\x7e\x62\xec\x05"),
        heads=(b"\x7e", b"\x7d", b"\x7e\x00\x11", b"\x7e\x00\x11\x40"),
        fake=lambda rnd: b"\x7e" + stuffed(rnd[:2] + bytes((len(rnd) - 3,)) + rnd[2:]) + b"\x7e",
        fake_odds=2**-8,
        head=re.compile(b"\x7e"),
        odds=2**-16,
        longest=518,
    ),
    Codec(
        name="sts",
        framer=sts.Packets,
        encode=lambda packet: sts.instruction(packet.id, packet.code, packet.params),
        frames=st.builds(sts.Packet, IDS | st.just(254), BYTE, DATA),
        example=sts.Packet(3, 0, b"\xff\x07\x00\x00\x10\x04"),
        heads=(b"\xff", b"\xff\xff", b"\xff\xff\x03\x08", b"\xff\xff\x03\xfa"),
        fake=lambda rnd: b"\xff\xff\x03" + bytes((len(rnd),)) + rnd,
        fake_odds=2**-8,
        head=sts.Packets.head,
        odds=2**-8,
        longest=254,
        loose=frozenset((2, 3)),  # an id that becomes FF moves the head
    ),
    Codec(
        name="dynamixel",
        framer=dynamixel.Packets,
        encode=of_dynamixel,
        frames=FROM_HOST | FROM_SERVO,
        example=dynamixel.Packet(1, 0x55, 0, b"\xff\xff\xfd\x00"),
        heads=(b"\xff\xff\xfd", b"\xff\xff\xfd\x00", b"\xff\xff\xfd\x00\x01\x07\x00", b"\xff\xff\xfd\x00\x01\xf0\x03\x55"),
        fake=lambda rnd: b"\xff\xff\xfd\x00\x01" + bytes((len(rnd), 0)) + rnd,
        fake_odds=2**-16,
        head=dynamixel.Packets.head,
        odds=2**-16,
        longest=1024,
        loose=frozenset((5, 6)),
    ),
    Codec(
        name="line",
        framer=line.Lines,
        encode=lambda fields: line.sentence(*fields),
        frames=FIELDS.map(tuple),
        example=("NOSE", "1234", "A", "512"),
        heads=(b"$", b"$NOSE,1", b"*00\r\n", b"\n", b"$" * 90),
        fake=fake_line,
        fake_odds=2**-8,
        head=re.compile(rb"\*[0-9A-F]{2}\r\n"),
        odds=2**-8,
        longest=82,
    ),
)


@pytest.fixture(scope="module", params=CODECS, ids=repr)
def codec(request: pytest.FixtureRequest) -> Codec:
    return request.param


@pytest.fixture(scope="module", params=[each for each in CODECS if isinstance(each.framer(), Sized)], ids=repr)
def sized(request: pytest.FixtureRequest) -> Codec:
    return request.param


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20260)


class Wire:
    """A serial port without a wire: what is written is remembered, and answered at once. Enough of pyserial for the vendors' stacks."""

    baudrate, timeout, port, name, is_open, in_waiting = 10**6, 0.0, "wire", "wire", True, 0

    def __init__(self, answer: Callable[[bytes], bytes] = lambda data: b"") -> None:
        self.answer, self.sent, self._waiting = answer, b"", b""

    def write(self, data: Any) -> int:
        self.sent += bytes(data)
        self._waiting += self.answer(bytes(data))
        return len(data)

    def read(self, size: int = 1) -> bytes:
        data, self._waiting = self._waiting[:size], self._waiting[size:]
        return data

    def inWaiting(self) -> int:
        return len(self._waiting)

    def nothing(self) -> None:
        """What a port without buffers has to do."""

    open = close = flush = flushInput = reset_input_buffer = reset_output_buffer = nothing


class ServoWire(Wire):
    """The same as the port object of the servos' SDKs, which are alike; a reply is there at once or never."""

    is_using = False
    clearPort, writePort, readPort = Wire.flush, Wire.write, Wire.read

    def setPacketTimeout(self, length: int) -> None:
        """No clock."""

    def isPacketTimeout(self) -> bool:
        return not self._waiting


@pytest.fixture(scope="session")
def wire() -> type[Wire]:
    return Wire


@pytest.fixture(scope="session")
def servo_wire() -> type[ServoWire]:
    return ServoWire
