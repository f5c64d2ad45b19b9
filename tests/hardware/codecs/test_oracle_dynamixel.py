"""dynamixel-sdk against our protocol 2.0: its host asks our device side, and reads what that answers.

Two faults of dynamixel-sdk 4.1.0 bound what it can judge: it throws away the packet that it stuffed and sends the unstuffed one, and behind
the first FF FF FD it unstuffs wrongly. So nothing that needs stuffing is sent by it, and at most one such place is read by it.
"""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hardware.codecs import dynamixel

sdk = pytest.importorskip("dynamixel_sdk", reason="the oracle of Dynamixel is not installed: pip install oio[oracles]")

HEAD = b"\xff\xff\xfd"
IDS, WORD = st.integers(0, 252), st.integers(0, 65535)
PLAIN = st.binary(min_size=1, max_size=40).filter(lambda data: HEAD not in data)
ERRORS = st.sampled_from((0, 1, 7, dynamixel.ALERT))
GOOD = sdk.COMM_SUCCESS


def bus(servo_wire, answer):
    """The vendor's host, its wire, and the packets our framer read there; `answer` makes the status packets of one instruction."""
    framer, seen = dynamixel.Packets(), []

    def reply(data: bytes) -> bytes:
        packets = framer.feed(data)
        seen.extend(packets)
        return b"".join(answer(packet) for packet in packets)

    return sdk.PacketHandler(2.0), servo_wire(reply), seen


@given(id=IDS, model=WORD)
def test_ping(servo_wire, id, model):
    host, port, seen = bus(servo_wire, lambda packet: dynamixel.status(id, 0, model.to_bytes(2, "little") + b"\x26"))
    assert host.ping(port, id) == (model, GOOD, 0)
    assert port.sent == dynamixel.ping(id) and seen == [dynamixel.Packet(id, dynamixel.PING, 0, b"")]


@given(id=IDS, address=WORD, before=PLAIN, behind=st.binary(max_size=9), stuff=st.booleans(), error=ERRORS)
def test_read(servo_wire, id, address, before, behind, stuff, error):
    data = before + HEAD + b"\x00" * len(behind) if stuff else before
    host, port, seen = bus(servo_wire, lambda packet: dynamixel.status(id, error, data))
    got, result, said = host.readTxRx(port, id, address, len(data))
    assert (bytes(got), result, said) == (data, GOOD, error)
    assert port.sent == dynamixel.read(id, address, len(data))
    assert seen == [dynamixel.Packet(id, dynamixel.READ, 0, address.to_bytes(2, "little") + len(data).to_bytes(2, "little"))]


@given(id=IDS, address=st.integers(0, 999), data=PLAIN, error=ERRORS)
def test_write(servo_wire, id, address, data, error):
    host, port, seen = bus(servo_wire, lambda packet: dynamixel.status(id, error))
    assert host.writeTxRx(port, id, address, len(data), list(data)) == (GOOD, error)
    assert port.sent == dynamixel.write(id, address, data)
    assert seen == [dynamixel.Packet(id, dynamixel.WRITE, 0, address.to_bytes(2, "little") + data)]


@given(found=st.dictionaries(IDS, PLAIN.map(lambda data: data.ljust(10, b"\x01")[:10]), min_size=1, max_size=6))
def test_sync_read(servo_wire, found):
    host, port, _ = bus(servo_wire, lambda packet: b"".join(dynamixel.status(id, 0, found[id]) for id in packet.params[4:]))
    group = sdk.GroupSyncRead(port, host, dynamixel.PRESENT_CURRENT.address, 10)
    assert all(group.addParam(id) for id in found)
    assert group.txRxPacket() == GOOD
    assert port.sent == dynamixel.sync_read(dynamixel.PRESENT_CURRENT.address, 10, found)
    assert {id: bytes(group.data_dict[id]) for id in found} == found


@given(goals=st.dictionaries(IDS, st.integers(0, 4095).map(lambda tick: tick.to_bytes(4, "little")), min_size=1, max_size=6))
def test_sync_write(servo_wire, goals):
    host, port, seen = bus(servo_wire, lambda packet: b"")
    group = sdk.GroupSyncWrite(port, host, *dynamixel.GOAL_POSITION)
    assert all(group.addParam(id, list(data)) for id, data in goals.items())
    assert group.txPacket() == GOOD
    assert port.sent == dynamixel.sync_write(dynamixel.GOAL_POSITION.address, goals)
    assert [packet.instruction for packet in seen] == [dynamixel.SYNC_WRITE]


@given(st.binary(max_size=100))
def test_the_crc(data):
    assert dynamixel.crc16(data) == sdk.PacketHandler(2.0).updateCRC(0, data, len(data))


@given(params=st.lists(st.sampled_from((0xFF, 0xFD, 0x00)), max_size=30))
def test_stuffing_as_they_compute_it(params):
    """What their stuffing returns, before it is thrown away."""
    bare = [0xFF, 0xFF, 0xFD, 0, 1, len(params) + 3, 0, dynamixel.WRITE, *params, 0, 0]
    ours = dynamixel.instruction(1, dynamixel.WRITE, bytes(params))
    assert bytes(sdk.PacketHandler(2.0).addStuffing(bare)[:-2]) == ours[:-2]


def test_they_send_what_they_did_not_stuff(servo_wire):
    """If this fails, the fault is mended and the tests above can send FF FF FD too."""
    host, port, seen = bus(servo_wire, lambda packet: dynamixel.status(1, 0))
    host.writeTxOnly(port, 1, 116, 4, [0xFF, 0xFF, 0xFD, 0x00])
    assert HEAD + b"\xfd" not in port.sent and seen == []
