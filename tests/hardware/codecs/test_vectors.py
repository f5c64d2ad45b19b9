"""The frames that the manufacturers' documents print, made and read."""

import pytest

from hardware.codecs import dynamixel, line, modbus, scd4x, shdlc, sts

H = bytes.fromhex

SCD30 = 0x61


def test_scd30_start_ready_and_read_requests():
    assert modbus.write_request(SCD30, 0x36, 0) == H("61 06 0036 0000 6064")
    assert modbus.read_request(SCD30, 0x27, 1) == H("61 03 0027 0001 3DA1")
    assert modbus.read_request(SCD30, 0x28, 6) == H("61 03 0028 0006 4C60")
    assert modbus.Requests(SCD30).feed(H("61 06 0036 0000 6064 61 03 0028 0006 4C60")) == [
        modbus.Request(6, 0x36, 0), modbus.Request(3, 0x28, 6),
    ]  # fmt: skip


def test_scd30_measurement():
    raw = H("61 03 0C 43DB8C2E 41D9E7FF 42433A1B 5007")
    (reply,) = modbus.Replies(SCD30).feed(raw)
    assert isinstance(reply, modbus.Reply)
    assert modbus.floats(reply.words) == pytest.approx((439.095, 27.238, 48.807), abs=6e-4)
    assert modbus.read_reply(SCD30, 3, modbus.words_of(modbus.floats(reply.words))) == raw


def test_scd4x_crc_and_start():
    assert scd4x.crc8(H("BEEF")) == 0x92
    assert scd4x.packed([0xBEEF]) == H("BEEF92") and scd4x.unpacked(H("BEEF92")) == (0xBEEF,) and scd4x.unpacked(H("BEEF93")) is None
    assert scd4x.command(scd4x.START) == H("21B1")


def test_scd4x_measurement():
    # data sheet v1.7, section 3.6.2: 500 ppm, 25 degC, 37 %RH
    words = scd4x.unpacked(H("01F433 6667A2 5EB93C"))
    assert words is not None and scd4x.measured(words) == pytest.approx((500, 25, 37), abs=5e-3)
    assert scd4x.words_measured(*scd4x.measured(words)) == words


def test_shdlc_stuffs_the_reserved_bytes():
    raw = H("7E 00 11 04 7D5E 7D5D 7D31 7D33".replace("00 11", "00 7D31")) + b"\xcb\x7e"
    assert shdlc.mosi(0, 0x11, H("7E7D1113")) == raw
    assert shdlc.Mosi().feed(raw) == [shdlc.Frame(0, 0x11, 0, H("7E7D1113"))]
    assert shdlc.Miso().feed(shdlc.miso(0, 0x11, shdlc.NACK)) == [shdlc.Frame(0, 0x11, shdlc.NACK, b"")]


def test_sts_read_position_of_3():
    raw = H("FF FF 03 04 02 38 02 BC")
    assert sts.read(3, *sts.PRESENT_POSITION) == raw
    assert sts.Packets().feed(raw) == [sts.Packet(3, sts.READ, H("3802"))]


def test_dynamixel_ping_and_its_status():
    # ROBOTIS e-Manual, Protocol 2.0, Ping: id 1, then model 1030 and firmware 38
    assert dynamixel.ping(1) == H("FF FF FD 00 01 03 00 01 19 4E")
    raw = H("FF FF FD 00 01 07 00 55 00 06 04 26 65 5D")
    assert dynamixel.Packets().feed(raw) == [dynamixel.Packet(1, dynamixel.STATUS, 0, H("060426"))]
    assert dynamixel.status(1, 0, H("060426")) == raw


def test_line():
    # NMEA 0183: the check of GPGLL,5300.97914,N,00259.98174,E,125926,A is 28
    raw = b"$GPGLL,5300.97914,N,00259.98174,E,125926,A*28\r\n"
    fields = ("GPGLL", "5300.97914", "N", "00259.98174", "E", "125926", "A")
    assert line.sentence(*fields) == raw and line.Lines().feed(raw) == [fields]
    assert line.Commands().feed(line.command("SA") + b"P100\r\n") == ["SA", "P100"]
