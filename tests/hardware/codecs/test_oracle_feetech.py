"""feetech-servo-sdk against our STS packets: its host asks our device side, and reads what that answers."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hardware.codecs import sts

sdk = pytest.importorskip("scservo_sdk", reason="the oracle of the STS bus is not installed: pip install oio[oracles]")

IDS, BYTE = st.integers(0, 252), st.integers(0, 255)
ERRORS = st.sampled_from((0, sts.VOLTAGE_ERROR, sts.OVERHEAT, sts.OVERLOAD))
GOOD = sdk.COMM_SUCCESS


def bus(servo_wire, answer):
    """The vendor's host, its wire, and the packets our framer read there; `answer` makes the status packets of one instruction."""
    framer, seen = sts.Packets(), []

    def reply(data: bytes) -> bytes:
        packets = framer.feed(data)
        seen.extend(packets)
        return b"".join(answer(packet) for packet in packets)

    return sdk.PacketHandler(0), servo_wire(reply), seen


@given(id=IDS)
def test_ping(servo_wire, id):
    model = sts.STS3215_MODEL.to_bytes(2, "little")
    host, port, seen = bus(servo_wire, lambda packet: sts.status(id, 0, model if packet.code == sts.READ else b""))
    assert host.ping(port, id) == (sts.STS3215_MODEL, GOOD, 0)
    assert port.sent == sts.ping(id) + sts.read(id, *sts.MODEL)
    assert [packet.code for packet in seen] == [sts.PING, sts.READ]


@given(id=IDS, address=BYTE, data=st.binary(min_size=1, max_size=40), error=ERRORS)
def test_read(servo_wire, id, address, data, error):
    host, port, seen = bus(servo_wire, lambda packet: sts.status(id, error, data))
    assert host.readTxRx(port, id, address, len(data)) == (list(data), GOOD, error)
    assert port.sent == sts.read(id, address, len(data))
    assert seen == [sts.Packet(id, sts.READ, bytes((address, len(data))))]


@given(id=IDS, address=BYTE, data=st.binary(min_size=1, max_size=40), error=ERRORS)
def test_write(servo_wire, id, address, data, error):
    host, port, seen = bus(servo_wire, lambda packet: sts.status(id, error))
    assert host.writeTxRx(port, id, address, len(data), list(data)) == (GOOD, error)
    assert port.sent == sts.write(id, address, data)
    assert seen == [sts.Packet(id, sts.WRITE, bytes((address,)) + data)]


@given(found=st.dictionaries(IDS, st.binary(min_size=6, max_size=6), min_size=1, max_size=6))
def test_sync_read(servo_wire, found):
    host, port, seen = bus(servo_wire, lambda packet: b"".join(sts.status(id, 0, found[id]) for id in packet.params[2:]))
    group = sdk.GroupSyncRead(port, host, sts.PRESENT_POSITION.address, 6)
    assert all(group.addParam(id) for id in found)
    assert group.txRxPacket() == GOOD
    assert port.sent == sts.sync_read(sts.PRESENT_POSITION.address, 6, found)
    assert {id: bytes(group.data_dict[id]) for id in found} == found
    position = {id: int.from_bytes(data[:2], "little") for id, data in found.items()}
    assert {id: group.getData(id, *sts.PRESENT_POSITION) for id in found} == position
    assert [packet.code for packet in seen] == [sts.SYNC_READ]


@given(goals=st.dictionaries(IDS, st.binary(min_size=2, max_size=2), min_size=1, max_size=6))
def test_sync_write(servo_wire, goals):
    host, port, seen = bus(servo_wire, lambda packet: b"")
    group = sdk.GroupSyncWrite(port, host, *sts.GOAL_POSITION)
    assert all(group.addParam(id, list(data)) for id, data in goals.items())
    assert group.txPacket() == GOOD
    assert port.sent == sts.sync_write(sts.GOAL_POSITION.address, goals)
    assert [packet.code for packet in seen] == [sts.SYNC_WRITE]


@given(value=st.integers(-32767, 32767))
def test_sign_and_magnitude(value):
    assert sts.magnitude(value, 15) == sdk.SCS_TOSCS(value, 15)
    assert sts.signed(sdk.SCS_TOSCS(value, 15), 15) == sdk.SCS_TOHOST(sts.magnitude(value, 15), 15) == value


def test_both_refuse_every_flipped_bit_but_of_the_head(servo_wire):
    """A flipped head or id or length makes their host wait for other bytes, not refuse: those are left out."""
    raw = sts.status(3, 0, b"\xff\x07")
    for bit in range(32, 8 * len(raw)):
        spoilt = bytearray(raw)
        spoilt[bit // 8] ^= 1 << bit % 8
        host, port, _ = bus(servo_wire, lambda packet, spoilt=bytes(spoilt): spoilt)
        assert host.readTxRx(port, 3, 56, 2)[1] != GOOD
        assert sts.Packets().feed(bytes(spoilt)) == []
