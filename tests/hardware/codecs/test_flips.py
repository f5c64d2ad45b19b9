"""A single flipped bit is never accepted: no frame that is read afterwards contains it."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import binom

from hardware.codecs import dynamixel, line, modbus, scd4x, sts


def flipped(raw: bytes, bit: int) -> bytes:
    return raw[: bit // 8] + bytes((raw[bit // 8] ^ 1 << bit % 8,)) + raw[bit // 8 + 1 :]


def read(codec, data: bytes) -> list:
    framer = codec.framer()
    return framer.feed(data) + framer.flush()


def test_no_flip_anywhere_in_the_example_passes(codec):
    raw = codec.encode(codec.example)
    assert read(codec, raw) == [codec.example]
    assert [bit for bit in range(8 * len(raw)) if read(codec, flipped(raw, bit))] == []


@pytest.mark.parametrize("raw", ["6103002700013DA1", "610300280006 4C60", "610600360000 6064"])
def test_no_flip_in_the_requests_to_an_scd30_passes(raw):
    raw = bytes.fromhex(raw)
    assert not any(modbus.Requests(0x61).feed(flipped(raw, bit)) for bit in range(64))


def test_no_flip_in_the_measurement_of_an_scd30_passes():
    raw = bytes.fromhex("61030C43DB8C2E41D9E7FF42433A1B5007")
    for bit in range(8 * len(raw)):
        framer = modbus.Replies(0x61)
        assert framer.feed(flipped(raw, bit)) + framer.flush() == []


@settings(max_examples=100)
@given(data=st.data())
def test_no_flip_passes_where_the_check_guarantees_it(codec, data):
    """What is read after a flip lay ready in the payload: a frame within a frame, which a framer that loses no frame must find."""
    frame = data.draw(codec.frames)
    raw = codec.encode(frame)
    tight = [at for at in range(len(raw)) if at not in codec.loose]
    bit = 8 * data.draw(st.sampled_from(tight)) + data.draw(st.integers(0, 7))
    for found in read(codec, flipped(raw, bit)):
        assert found != frame and codec.encode(found)[1:] in raw


def test_a_frame_within_a_frame_surfaces_when_the_outer_one_is_spoilt():
    """The price of losing no frame. A Dynamixel packet cannot hold a head, and a request is too short."""
    inner = sts.status(3, 0, b"\xff\x07")
    outer = sts.sync_write(42, {1: inner})
    assert [packet.id for packet in sts.Packets().feed(outer)] == [sts.BROADCAST]
    assert sts.Packets().feed(flipped(outer, 8 * len(outer) - 1)) == [sts.Packet(3, 0, b"\xff\x07")]


def test_a_flip_of_the_length_passes_as_rarely_as_the_check_is_long(sized, rng):
    trials = passed = 0
    for _ in range(500 if sized.loose else 0):
        raw = repaired(sized.name, sized.fake(rng.bytes(int(rng.integers(4, 40)))))
        assert sized.framer().feed(raw)
        for bit in (8 * byte + bit for byte in sorted(sized.loose) for bit in range(8)):
            trials += 1
            passed += bool(read(sized, flipped(raw, bit)))
    print(f"{sized}: {passed} of {trials} passed")
    assert passed <= binom.ppf(1 - 1e-6, trials, sized.odds)


def repaired(name: str, raw: bytes) -> bytes:
    if name == "sts":
        return sts.instruction(raw[2], raw[4], raw[5:-1])
    if name == "modbus replies":
        return raw[:-2] + modbus.crc16(raw[:-2]).to_bytes(2, "little")
    return dynamixel.instruction(raw[4], raw[7], raw[8:-2])


@given(words=st.lists(st.integers(0, 65535), min_size=1, max_size=6), data=st.data())
def test_no_flip_in_a_word_of_an_scd4x_passes(words, data):
    raw = scd4x.packed(words)
    assert scd4x.unpacked(raw) == tuple(words)
    assert scd4x.unpacked(flipped(raw, data.draw(st.integers(0, 8 * len(raw) - 1)))) is None


def test_crc8_finds_every_two_bits_in_a_word():
    raw = scd4x.packed([0xBEEF])
    pairs = [(a, b) for a in range(24) for b in range(a)]
    assert all(scd4x.unpacked(flipped(flipped(raw, a), b)) is None for a, b in pairs)


def test_a_check_in_lower_case_is_none():
    assert line.sentence("A", "B") == b"$A,B*2F\r\n"
    assert line.Lines().feed(b"$A,B*2f\r\n") == []
