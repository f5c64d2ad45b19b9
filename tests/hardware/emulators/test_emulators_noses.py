"""Emulated noses and the valve: what they answer to the bytes of the data sheets, whatever way these are cut, and never a crash."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hardware.codecs import modbus, scd4x, shdlc
from hardware.codecs.line import Lines
from hardware.emulators.device import Electronics
from hardware.emulators.line import HOLD_S, LineNose, Valve
from hardware.emulators.scd30 import BOOT_S, Scd30
from hardware.emulators.scd41 import Scd41, SensorBridge

ADDRESS = 0x61
DATA_SHEET_PPM = modbus.floats((0x43DB, 0x8C2E))[0]  # 439.095, the interface description's example


class Smell:
    """Counts up by one each time it is asked."""

    def __init__(self, first=DATA_SHEET_PPM):
        self.value, self.asked = first, []

    def __call__(self, element):
        self.asked.append(element)
        self.value += 1.0
        return self.value - 1.0


def scd30(update_s=2.0):
    trouble, smell = set(), Smell()
    return Scd30(Electronics(smell, 40_000.0, trouble), update_s, trouble), trouble, smell


def scd41(update_s=5.0):
    trouble, smell = set(), Smell(439.0)
    return SensorBridge(Scd41(Electronics(smell, 40_000.0, trouble), update_s), trouble), trouble


def nose(elements=2):
    trouble, smell = set(), Smell(100.0)
    return LineNose(Electronics(smell, 1023.0, trouble), elements, 10, trouble), trouble


def read(device, register, count=1):
    """Words, or the code of the refusal."""
    (reply,) = modbus.Replies(ADDRESS).feed(device.answer(modbus.read_request(ADDRESS, register, count)))
    return reply.words if isinstance(reply, modbus.Reply) else reply.code


def wrote(device, register, value):
    (reply,) = modbus.Replies(ADDRESS).feed(device.answer(modbus.write_request(ADDRESS, register, value)))
    return reply


def bridged(device, command, data=b""):
    (frame,) = shdlc.Miso().feed(device.answer(shdlc.mosi(0, command, data)))
    assert frame.command == command
    return frame


def asked(device, command, words=0):
    """(state, words) of a command of the SCD41."""
    frame = bridged(device, scd4x.TRANSCEIVE, scd4x.transceive(scd4x.ADDRESS, scd4x.command(command), 3 * words, 100_000))
    return frame.state, scd4x.unpacked(frame.data)


def awake():
    device, trouble = scd41()
    bridged(device, scd4x.SUPPLY, b"\x00\x01")
    return device, trouble


def said(data):
    return Lines().feed(data)


@given(st.lists(st.binary(max_size=40), max_size=8))
def test_no_bytes_whatever_upset_a_device(chunks):
    for device in (scd30()[0], scd41()[0], nose()[0], Valve(lambda source: None, set())):
        for t_s, chunk in enumerate(chunks):
            assert isinstance(device.answer(chunk), bytes)
            device.tick(float(t_s))


@given(st.integers(1, 7))
def test_a_question_may_come_in_pieces(cut):
    question = modbus.read_request(ADDRESS, 0x27, 1)
    whole, parts = scd30()[0], scd30()[0]
    assert parts.answer(question[:cut]) + parts.answer(question[cut:]) == whole.answer(question) != b""


def test_an_scd30_answers_the_bytes_of_its_data_sheet():
    device, _, _ = scd30()
    device.tick(2.0)
    assert device.answer(bytes.fromhex("610300270001 3DA1")) == modbus.read_reply(ADDRESS, 3, (1,))
    reply = device.answer(bytes.fromhex("610300280006 4C60"))
    assert reply.startswith(bytes.fromhex("61030C 43DB8C2E")) and len(reply) == 17
    start = bytes.fromhex("6106003600006064")
    assert device.answer(start) == start


def test_a_new_value_every_update_and_ready_once():
    device, _, smell = scd30(update_s=0.1)
    seen = []
    for tick in range(1, 101):
        device.tick(0.02 * tick)
        if read(device, 0x27) == (1,):
            seen.append(modbus.floats(read(device, 0x28, 6))[0])
            assert read(device, 0x27) == (0,)
    assert len(seen) == 20 and seen == sorted(set(seen)) and smell.asked == [0] * 20


def test_registers_keep_what_they_may_and_refuse_the_rest():
    device, trouble, _ = scd30()
    assert read(device, 0x20) == (0x0342,)
    assert wrote(device, 0x25, 7) == modbus.Reply(6, (0x25, 7)) and read(device, 0x25) == (7,)
    assert wrote(device, 0x25, 1) == modbus.ExceptionResponse(6, modbus.ILLEGAL_VALUE) and read(device, 0x25) == (7,)
    assert wrote(device, 0x20, 1) == modbus.ExceptionResponse(6, modbus.ILLEGAL_ADDRESS)
    assert read(device, 0x99) == modbus.ILLEGAL_ADDRESS and read(device, 0x28, 7) == modbus.ILLEGAL_ADDRESS
    trouble.add("nack")
    assert read(device, 0x20) == modbus.DEVICE_FAILURE


def test_stopped_it_measures_nothing_until_it_is_started():
    device, _, smell = scd30()
    wrote(device, 0x37, 1)
    device.tick(10.0)
    assert smell.asked == [] and read(device, 0x27) == (0,)
    wrote(device, 0x36, 0)
    device.tick(11.9)
    assert smell.asked == []
    device.tick(12.0)
    assert smell.asked == [0]


def test_replugged_it_boots_and_goes_on():
    device, _, smell = scd30()
    wrote(device, 0x25, 7)
    device.power_on(30.0)
    assert device.answer(modbus.read_request(ADDRESS, 0x20, 1)) == b""
    device.tick(30.0 + BOOT_S)
    assert read(device, 0x25) == (7,)
    device.tick(32.0 + BOOT_S)
    assert smell.asked == [0]


def test_values_stick_and_saturate():
    device, trouble, _ = scd30(update_s=0.02)

    def value(t_s):
        device.tick(t_s)
        return modbus.floats(read(device, 0x28, 6))[0]

    first = value(0.02)
    trouble.add("stuck")
    assert value(0.04) == value(0.06) == first and read(device, 0x27) == (0,)
    trouble.clear()
    assert value(0.08) > first
    trouble.add("saturated")
    assert value(0.1) == 40_000.0


def test_an_scd41_behind_its_bridge():
    device, _ = awake()
    assert asked(device, scd4x.VARIANT, 1) == (0, (0x1440,))
    assert asked(device, scd4x.SERIAL, 3)[1] is not None
    assert asked(device, scd4x.START) == (0, ())
    assert asked(device, scd4x.READ, 3)[0] == shdlc.NACK  # nothing measured yet
    assert not scd4x.is_ready(asked(device, scd4x.READY, 1)[1][0])
    device.tick(5.0)
    assert scd4x.is_ready(asked(device, scd4x.READY, 1)[1][0])
    state, words = asked(device, scd4x.READ, 3)
    assert state == 0 and scd4x.measured(words) == (439.0, pytest.approx(25.0, abs=0.01), pytest.approx(50.0, abs=0.01))
    assert asked(device, scd4x.READ, 3)[0] == shdlc.NACK  # the buffer is empty again


def test_while_it_measures_it_takes_no_other_command():
    device, _ = awake()
    asked(device, scd4x.START)
    assert [asked(device, command, words)[0] for command, words in ((scd4x.VARIANT, 1), (scd4x.START, 0))] == [shdlc.NACK] * 2
    assert asked(device, scd4x.STOP)[0] == 0
    assert asked(device, scd4x.VARIANT, 1)[0] == shdlc.NACK  # for half a second more
    device.tick(0.5)
    assert asked(device, scd4x.VARIANT, 1) == (0, (0x1440,))


def test_the_answer_may_be_fetched_later():
    """Sensirion's driver writes a command, waits, then reads."""
    device, _ = awake()
    bridged(device, scd4x.TRANSCEIVE, scd4x.transceive(scd4x.ADDRESS, scd4x.command(scd4x.VARIANT), 0, 0))
    frame = bridged(device, scd4x.TRANSCEIVE, scd4x.transceive(scd4x.ADDRESS, b"", 3, 0))
    assert frame.state == 0 and scd4x.unpacked(frame.data) == (0x1440,)


def test_the_bridge_itself():
    device, trouble = scd41()
    assert bridged(device, scd4x.DEVICE_INFO, b"\x01").data == b"SEK-SensorBridge\0"
    assert len(bridged(device, scd4x.VERSION).data) == 7
    assert asked(device, scd4x.VARIANT, 1)[0] == shdlc.NACK  # its supply is off
    assert bridged(device, 0x77).state == 0x02
    bridged(device, scd4x.SUPPLY, b"\x00\x01")
    assert asked(device, scd4x.VARIANT, 1)[0] == 0
    other = scd4x.transceive(0x11, scd4x.command(scd4x.VARIANT), 3, 0)
    assert bridged(device, scd4x.TRANSCEIVE, other).state == shdlc.NACK  # nobody has that address
    trouble.add("nack")
    assert bridged(device, scd4x.VERSION).state == shdlc.NACK
    trouble.clear()
    device.power_on(9.0)
    assert asked(device, scd4x.VARIANT, 1)[0] == shdlc.NACK  # off again


def test_a_line_nose_speaks_every_period_with_the_time_of_its_values():
    device, _ = nose()
    frames = [frame for tick in range(1, 51) for frame in said(device.tick(0.02 * tick))]
    assert [int(ms) for _, ms, *_ in frames] == [100 * i for i in range(1, 11)]
    assert frames[0] == ("NOSE", "100", "A", "100", "101")
    assert said(device.answer(b"P40\n")) == [("ACK", "P40", "1000")]
    frames = [frame for tick in range(51, 61) for frame in said(device.tick(0.02 * tick))]
    assert [int(ms) for _, ms, *_ in frames] == [1040, 1080, 1120, 1160, 1200]


def test_it_says_which_element_was_chosen():
    device, _ = nose()
    assert said(device.answer(b"SB\n")) == [("ACK", "SB", "0")]
    assert said(device.tick(0.1))[0][2] == "B"
    device.answer(b"SA\n")
    assert said(device.tick(0.2))[0][2] == "A"


@pytest.mark.parametrize("command", ["P19", "P10001", "P", "P-5", "SC", "sa", "X", "V3", "HELLO", "P0000000000000500"])
def test_what_it_does_not_know_it_refuses(command):
    device, _ = nose()
    assert said(device.answer(f"{command}\n".encode())) == [("NAK", command if len(command) <= 16 else f"{command[:15]}?")]


def test_it_says_who_it_is():
    device, trouble = nose()
    assert said(device.answer(b"ID\n")) == [("ACK", "ID", "OIO-NOSE", "1", "10")]
    trouble.add("nack")
    assert said(device.answer(b"ID\n")) == [("NAK", "ID")]


def test_one_element_leaves_the_other_channel_at_nothing():
    device, _ = nose(elements=1)
    assert said(device.tick(0.1))[0][3:] == ("100", "0")


def test_its_clock_jumps_and_begins_again_at_power_up():
    device, trouble = nose()
    trouble.add("clock")
    assert said(device.tick(0.1))[0][1] == "10100"
    trouble.clear()
    assert said(device.tick(0.2))[0][1] == "200"
    device.answer(b"SB\n")
    device.power_on(1.0)
    assert device.answer(b"ID\n") == b"" and device.tick(2.0) == b""  # the bootloader waits
    ms, active = said(device.tick(2.9))[0][1:3]
    assert (ms, active) == ("100", "A")


def test_saturated_is_full_scale():
    device, trouble = nose()
    trouble.add("saturated")
    assert said(device.tick(0.1))[0][3:] == ("1023", "1023")


def test_a_valve_opens_one_source():
    opened = []
    valve = Valve(opened.append, set())
    valve.tick(3.0)
    assert said(valve.answer(b"V1\nV2\nV0\n")) == [("ACK", "V1", "3000"), ("ACK", "V2", "3000"), ("ACK", "V0", "3000")]
    assert opened == ["beacon", "source", "none"]
    assert said(valve.answer(b"SA\n")) == [("NAK", "SA")]
    valve.power_on(5.0)
    assert opened[-1] == "none" and len(opened) == 4


def test_a_valve_closes_by_itself_unless_it_is_told_again_and_does_so_once():
    opened = []
    valve = Valve(opened.append, set())
    for tick in range(1, 2501):  # 50 s; it is told up to the 16th
        t_s = 0.02 * tick
        assert valve.tick(t_s) == b""
        if tick % 400 == 50:
            assert said(valve.answer(b"V2\n" if t_s < 20.0 else b"ID\n"))
        assert opened == (["source"] if 1.0 <= t_s < 17.0 + HOLD_S - 1e-6 else ["source", "none"] if t_s > 2.0 else []), t_s
    valve.answer(b"V1\n")
    assert opened == ["source", "none", "beacon"]  # it can be opened again
