"""What the bytes of a frame mean, and what cannot be encoded."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hardware.codecs import dynamixel, line, modbus, scd4x, shdlc, sts

WORD = st.integers(0, 65535)
REFUSED = (ValueError, struct.error, OverflowError)  # how Python's own packing refuses what does not fit


@given(st.lists(st.floats(width=32, allow_nan=False), max_size=8))
def test_floats_of_words_of_floats(values):
    assert modbus.floats(modbus.words_of(values)) == tuple(values)


@given(st.lists(WORD, max_size=8).filter(lambda words: len(words) % 2))
def test_half_a_float_is_refused(words):
    with pytest.raises(REFUSED):
        modbus.floats(words)


@given(st.tuples(WORD, WORD, WORD))
def test_words_measured_is_the_inverse_of_measured(words):
    assert scd4x.words_measured(*scd4x.measured(words)) == words


@given(st.floats(0, 40000), st.floats(-45, 130), st.floats(0, 100))
def test_measured_is_the_inverse_of_words_measured_to_half_a_step(ppm, degc, pct_rh):
    got = scd4x.measured(scd4x.words_measured(ppm, degc, pct_rh))
    steps = (1, 175 / 65535, 100 / 65535)
    assert all(abs(a - b) <= 0.5001 * step for a, b, step in zip(got, (ppm, degc, pct_rh), steps, strict=True))


def test_a_measurement_off_the_scale_is_held_at_its_end():
    assert scd4x.words_measured(1e6, -100, 120) == (65535, 0, 65535)
    assert scd4x.words_measured(-1, 1e3, -1) == (0, 65535, 0)


@given(st.binary(max_size=20))
def test_words_are_read_only_whole(data):
    words = scd4x.unpacked(data)
    assert words is None or scd4x.packed(words) == data


@given(st.integers(0, 65535), st.lists(WORD, max_size=3))
def test_a_command_and_its_arguments(code, words):
    tx = scd4x.command(code, *words)
    assert scd4x.commanded(tx) == (code, tuple(words))
    assert len(tx) == 2 + 3 * len(words) and scd4x.commanded(tx[:1]) is None
    assert not words or scd4x.commanded(tx[:-1]) is None


@given(st.integers(0, 127), st.binary(max_size=scd4x.MOST_TX), st.integers(0, 255), st.integers(0, 2**32 - 1), st.integers(0, 1))
def test_a_transfer_on_i2c(address, tx, rx_len, timeout_us, port):
    data = scd4x.transceive(address, tx, rx_len, timeout_us, port)
    assert scd4x.transfer(data) == scd4x.Transfer(port, address, tx, rx_len, timeout_us)
    assert shdlc.Mosi().feed(shdlc.mosi(0, scd4x.TRANSCEIVE, data))[0].data == data
    assert scd4x.transfer(data + b"x") is None and scd4x.transfer(b"\x01" + data[1:]) is None


@given(st.binary(max_size=40))
def test_no_transfer_raises(data):
    transfer = scd4x.transfer(data)
    assert (
        transfer is None or scd4x.transceive(transfer.i2c_address, transfer.tx, transfer.rx_len, transfer.timeout_us, transfer.port) == data
    )


@pytest.mark.parametrize(("word", "ready"), [(0, False), (0x8000, False), (0xF800, False), (1, True), (0x8006, True), (0x0400, True)])
def test_ready_looks_at_the_low_eleven_bits(word, ready):
    assert scd4x.is_ready(word) is ready


@given(st.integers(1, 15), st.data())
def test_sign_and_magnitude(bit, data):
    value = data.draw(st.integers(1 - (1 << bit), (1 << bit) - 1))
    word = sts.magnitude(value, bit)
    assert sts.signed(word, bit) == value and 0 <= word < 2 << bit
    for beyond in (1 << bit, -1 << bit):
        with pytest.raises(ValueError, match="does not fit"):
            sts.magnitude(beyond, bit)


def test_sign_and_magnitude_by_example():
    assert (sts.signed(0x8005, 15), sts.signed(0x0405, 10), sts.signed(0x0801, 11)) == (-5, -5, -1)
    assert sts.signed(0x8000, 15) == 0  # minus nothing


@given(st.binary(max_size=60) | st.lists(st.sampled_from((0xFF, 0xFD, 0x00)), max_size=60).map(bytes))
def test_a_dynamixel_packet_holds_no_second_head(params):
    raw = dynamixel.status(1, 0, params)
    assert b"\xff\xff\xfd\x00" not in raw[4:-2]
    assert dynamixel.Packets().feed(raw) == [dynamixel.Packet(1, dynamixel.STATUS, 0, params)]


def test_a_dynamixel_packet_that_is_not_stuffed_is_none():
    packet = bytes.fromhex("FFFFFD00 01 0600 03 FFFFFD")
    assert dynamixel.Packets().feed(packet + dynamixel.crc16(packet).to_bytes(2, "little")) == []


def test_sync_writes_lay_each_id_before_its_data():
    assert sts.Packets().feed(sts.sync_write(42, {1: b"ab", 5: b"cd"})) == [sts.Packet(254, 0x83, b"\x2a\x02\x01ab\x05cd")]
    assert dynamixel.Packets().feed(dynamixel.sync_write(116, {1: b"abcd"})) == [dynamixel.Packet(254, 0x83, 0, b"\x74\0\x04\0\x01abcd")]


@pytest.mark.parametrize("text", ["SA", "P20000", "x" * 16])
def test_commands_reach_the_device(text):
    framer = line.Commands()
    assert framer.feed(line.command(text) + text.encode() + b"\r\n\n\r\n") == [text, text]
    assert (framer.good, framer.corrupt, framer.skipped) == (2, 0, 2)  # the carriage returns


@pytest.mark.parametrize(
    ("sent", "got"),
    [
        (b"S\x01A", "S?A"),
        (b"$SA*", "?SA?"),
        (b"S,A", "S?A"),
        (b"SA\r\r", "SA?"),
        (b"\xe4", "?"),
        (b"P" * 40, "P" * 15 + "?"),
        (b"P0000000000000500", "P00000000000005?"),
    ],
)
def test_what_is_no_command_arrives_so_that_it_can_be_refused(sent, got):
    framer = line.Commands()
    assert [text for byte in sent + b"\n" for text in framer.feed(bytes((byte,)))] == [got]
    assert (framer.good, framer.corrupt, framer.skipped) == (0, 1, len(sent) - len(got))


@pytest.mark.parametrize("make", [
    lambda: modbus.read_request(256, 0, 1), lambda: modbus.write_request(1, 65536, 0), lambda: modbus.write_request(1, 0, -1),
    lambda: modbus.read_reply(1, 3, []), lambda: modbus.read_reply(1, 3, [0] * 126), lambda: modbus.refusal(1, 3, 256),
    lambda: shdlc.mosi(0, 0, bytes(256)), lambda: shdlc.miso(0, 0, 256), lambda: scd4x.packed([65536]), lambda: scd4x.command(-1),
    lambda: scd4x.transceive(0x62, bytes(241), 0, 0), lambda: scd4x.measured((1, 2)),
    lambda: sts.ping(255), lambda: sts.instruction(1, 3, bytes(249)), lambda: sts.sync_write(42, {1: b"a", 2: b"ab"}),
    lambda: sts.sync_write(42, {}), lambda: dynamixel.ping(253), lambda: dynamixel.ping(255), lambda: dynamixel.write(1, 0, bytes(1013)),
    lambda: dynamixel.sync_write(116, {1: b"a", 2: b"ab"}),
    lambda: line.sentence(), lambda: line.sentence("a,b"), lambda: line.sentence("a*"),
    lambda: line.sentence("$"), lambda: line.sentence("\n"), lambda: line.sentence("ä"), lambda: line.sentence("x" * 77),
    lambda: line.command(""), lambda: line.command("x" * 17), lambda: line.command("A\n"),
])  # fmt: skip
def test_what_does_not_fit_is_refused_not_cut(make):
    with pytest.raises(REFUSED):
        make()


def test_the_longest_frames_fit():
    longest = modbus.read_reply(0x61, 3, [0x7E7E] * 125)
    assert len(longest) == 255 and len(modbus.Replies(0x61).feed(longest)) == 1
    assert len(shdlc.Miso().feed(shdlc.miso(0x7E, 0x7E, 0x7E, b"\x7e" * 255))) == 1
    assert len(shdlc.Mosi().feed(shdlc.mosi(0x7E, 0x7E, b"\x7e" * 255))) == 1
    assert len(sts.Packets().feed(sts.status(1, 0, bytes(248)))) == 1
    assert len(dynamixel.write(1, 0, bytes(1012))) == 1024 and len(dynamixel.Packets().feed(dynamixel.write(1, 0, bytes(1012)))) == 1
    assert len(line.sentence("x" * 76)) == 82 and line.Lines().feed(line.sentence("x" * 76)) == [("x" * 76,)]
