"""minimalmodbus against our Modbus: it asks, our device side answers; it makes frames, our host side reads them."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hardware.codecs import modbus

minimalmodbus = pytest.importorskip("minimalmodbus", reason="the oracle of Modbus is not installed: pip install oio[oracles]")

SCD30 = 0x61
WORD = st.integers(0, 65535)
FEW = settings(max_examples=30)  # each transaction waits for 3.5 characters of silence


def asked(wire, reply: bytes):
    """The vendor's host on a wire where a device answers `reply` to anything; and the requests that our device side read."""
    requests: list[modbus.Request] = []
    framer = modbus.Requests(SCD30)

    def answer(data: bytes) -> bytes:
        requests.extend(framer.feed(data))
        return reply

    port = wire(answer)
    return minimalmodbus.Instrument(port, SCD30), requests, port


@FEW
@given(function=st.sampled_from((3, 4)), register=WORD, words=st.lists(WORD, min_size=1, max_size=20))
def test_a_read(wire, function, register, words):
    host, requests, port = asked(wire, modbus.read_reply(SCD30, function, words))
    assert host.read_registers(register, len(words), function) == words
    assert port.sent == modbus.read_request(SCD30, register, len(words), function)
    assert requests == [modbus.Request(function, register, len(words))]


@FEW
@given(register=WORD, value=WORD)
def test_a_write(wire, register, value):
    host, requests, port = asked(wire, modbus.write_reply(SCD30, register, value))
    host.write_register(register, value, functioncode=6)
    assert port.sent == modbus.write_request(SCD30, register, value)
    assert requests == [modbus.Request(6, register, value)]


@FEW
@given(value=st.floats(width=32, allow_nan=False))
def test_a_float(wire, value):
    host, _, _ = asked(wire, modbus.read_reply(SCD30, 3, modbus.words_of([value])))
    assert host.read_float(0x28) == value
    assert modbus.words_of([value]) == tuple(minimalmodbus._bytes_to_valuelist(minimalmodbus._float_to_bytes(value), 2))


@pytest.mark.parametrize(("code", "error"), [
    (modbus.ILLEGAL_FUNCTION, "IllegalRequestError"), (modbus.ILLEGAL_ADDRESS, "IllegalRequestError"),
    (modbus.ILLEGAL_VALUE, "IllegalRequestError"), (modbus.DEVICE_FAILURE, "SlaveReportedException"),
    (modbus.DEVICE_BUSY, "SlaveDeviceBusyError"),
])  # fmt: skip
def test_a_refusal(wire, code, error):
    host, _, _ = asked(wire, modbus.refusal(SCD30, 3, code))
    with pytest.raises(getattr(minimalmodbus, error)):
        host.read_registers(0x28, 6)


@given(function=st.sampled_from((3, 4)), words=st.lists(WORD, min_size=1, max_size=125))
def test_our_host_reads_a_reply_that_they_made(function, words):
    payload = bytes((2 * len(words),)) + minimalmodbus._valuelist_to_bytes(words, len(words))
    raw = minimalmodbus._embed_payload(SCD30, "rtu", function, payload)
    assert modbus.Replies(SCD30).feed(raw) == [modbus.Reply(function, tuple(words))]
    assert modbus.read_reply(SCD30, function, words) == raw


@given(register=WORD, value=WORD, code=st.integers(0, 255))
def test_our_host_reads_an_echo_and_a_refusal_that_they_made(register, value, code):
    echo = minimalmodbus._embed_payload(SCD30, "rtu", 6, register.to_bytes(2, "big") + value.to_bytes(2, "big"))
    refused = bytes((SCD30, 0x83, code))
    refused += minimalmodbus._calculate_crc(refused)
    assert modbus.Replies(SCD30).feed(echo + refused) == [modbus.Reply(6, (register, value)), modbus.ExceptionResponse(3, code)]


@given(st.binary(max_size=300))
def test_the_crc(data):
    assert modbus.crc16(data).to_bytes(2, "little") == minimalmodbus._calculate_crc(data)


def test_both_refuse_every_flipped_bit(wire):
    raw = bytes.fromhex("61030C43DB8C2E41D9E7FF42433A1B5007")
    for bit in range(8 * len(raw)):
        spoilt = bytearray(raw)
        spoilt[bit // 8] ^= 1 << bit % 8
        host, _, _ = asked(wire, bytes(spoilt))
        with pytest.raises(minimalmodbus.ModbusException):
            host.read_registers(0x28, 6)
        framer = modbus.Replies(SCD30)
        assert framer.feed(bytes(spoilt)) + framer.flush() == []
