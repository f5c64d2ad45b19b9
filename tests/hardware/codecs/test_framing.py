"""Laws of all framers: whatever surrounds a frame, however the stream is cut, a good frame is found and nothing else is."""

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from hardware.codecs import dynamixel, line, modbus, sts
from hardware.codecs.framing import Sized


def read(codec, *pieces):
    """All frames of a stream that has ended, and the framer."""
    framer = codec.framer()
    found = [frame for data in pieces for frame in framer.feed(data)]
    return found + framer.flush(), framer


def counts(framer):
    return framer.good, framer.corrupt, framer.skipped, framer.held


@settings(max_examples=25)
@given(data=st.data())
def test_what_was_encoded_is_read(codec, data):
    frame = data.draw(codec.frames)
    framer = codec.framer()
    assert framer.feed(codec.encode(frame)) == [frame] and counts(framer) == (1, 0, 0, 0)
    assert len(codec.encode(frame)) <= codec.longest + 2


@settings(max_examples=25)
@given(data=st.data())
def test_pieces_do_not_matter(codec, data):
    stream = data.draw(codec.noise()) + codec.encode(data.draw(codec.frames)) + data.draw(codec.noise())
    ends = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=8)))
    pieces = [stream[a:b] for a, b in zip([0, *ends], [*ends, len(stream)], strict=True)]
    whole, one = read(codec, stream)
    for cut in (pieces, [bytes((byte,)) for byte in stream]):
        found, many = read(codec, *cut)
        assert found == whole and counts(many) == counts(one)


@settings(max_examples=25)
@given(data=st.data())
def test_every_frame_that_noise_leaves_whole_is_found(codec, data):
    """Unless noise and what follows it happen to pass the check together: then what was found is itself a good frame of the stream."""
    sent = data.draw(st.lists(codec.frames, min_size=1, max_size=4))
    noise = [data.draw(codec.noise()) for _ in range(len(sent) + 1)]
    stream = noise[0] + b"".join(codec.encode(frame) + noise[at + 1] for at, frame in enumerate(sent))
    found, framer = read(codec, stream)
    rest = iter(found)
    assert all(frame in rest for frame in sent) or any(codec.encode(frame) in stream for frame in found if frame not in sent)
    assert framer.good == len(found)


@settings(max_examples=25)
@given(data=st.data())
def test_frames_are_in_the_stream_as_read_and_in_order(codec, data):
    stream = data.draw(codec.noise()) + codec.encode(data.draw(codec.frames)) + data.draw(codec.noise())
    found, _ = read(codec, stream)
    at = 0
    for frame in found:
        at = stream.index(codec.encode(frame)[1:], at)  # SHDLC frames may share a flag


@settings(max_examples=25)
@given(data=st.data())
def test_the_first_good_frame_from_the_left_wins(sized, data):
    """The framer against its definition: at each byte, is there a frame that begins here?"""
    stream = data.draw(sized.noise()) + sized.encode(data.draw(sized.frames)) + data.draw(sized.noise())
    expected, at = [], 0
    while at < len(stream):
        head = sized.head.match(stream, at)
        size = sized.framer()._size(head[0]) if head else 0
        found = sized.framer().feed(stream[at : at + size])
        whole = len(found) == 1 and len(sized.encode(found[0])) == size
        expected += found if whole else []
        at += size if whole else 1
    assert read(sized, stream)[0] == expected


@settings(max_examples=25)
@given(data=st.data())
def test_a_false_head_delays_a_frame_by_its_own_length_at_most(codec, data):
    noise, frame = data.draw(codec.noise()), data.draw(codec.frames)
    framer = codec.framer()
    found = framer.feed(noise + codec.encode(frame))
    if isinstance(framer, Sized):
        found += framer.feed(bytes(codec.longest))
    assert frame in found or any(codec.encode(f) in noise + codec.encode(frame) + bytes(codec.longest) for f in found)


@settings(max_examples=25)
@given(data=st.data())
def test_no_byte_is_lost_from_the_books(codec, data):
    stream = data.draw(codec.noise()) + codec.encode(data.draw(codec.frames)) + data.draw(codec.noise())
    framer = codec.framer()
    found = framer.feed(stream)
    framed = sum(len(codec.encode(frame)) for frame in found)
    booked = framed + framer.skipped + framer.held
    if isinstance(framer, Sized):
        assert booked == len(stream)
    else:  # marks are in no account but their frame's
        assert len(stream) - stream.count(framer.mark) <= booked <= len(stream) + len(found)


@settings(max_examples=25)
@given(data=st.data())
def test_memory_is_bounded(codec, data):
    framer = codec.framer()
    for chunk in data.draw(st.lists(codec.noise(), max_size=10)):
        framer.feed(chunk * 20)
        assert framer.held <= codec.longest + 1
    framer.flush()
    assert framer.held == 0


@settings(max_examples=25)
@given(data=st.data())
def test_one_spoilt_frame_counts_once_and_costs_no_other(codec, data):
    frames = data.draw(st.lists(codec.frames, min_size=3, max_size=3))
    raws = [codec.encode(frame) for frame in frames]
    behind = 4 if codec.name == "line" else 2 if codec.name.startswith("shdlc") else 1
    check = raws[1][-behind] ^ 1
    assume(check not in (0x7C, 0x7D, 0x7E, 0x7F, 0x11, 0x13))  # where a flag or an escape would come to be
    raws[1] = raws[1][:-behind] + bytes((check,)) + raws[1][len(raws[1]) - behind + 1 :]
    found, framer = read(codec, *raws)
    assume(len(found) < 3)  # the payload of the spoilt one held a good frame
    assert found == [frames[0], frames[2]] and framer.corrupt == 1


def test_a_frame_may_begin_in_the_second_byte_of_a_false_head():
    """An address that is a function too: 03 04 02 .. reads as 03 03 04 .. when a 03 comes before it."""
    framer = modbus.Replies(3)
    assert framer.feed(b"\x03" + modbus.read_reply(3, 4, [7])) + framer.flush() == [modbus.Reply(4, (7,))]


def test_false_heads_in_a_spoilt_frame_are_its_payload():
    """One corrupt frame, not three; a frame behind it counts anew."""
    spoilt = bytearray(sts.sync_write(42, {1: b"\xff\xff\x03\x04\x02\x38", 2: b"\xff\xff\x05\x03\x02\x38"}))
    spoilt[-1] ^= 1
    framer = sts.Packets()
    assert framer.feed(bytes(spoilt) + sts.ping(1) + bytes(spoilt)) + framer.flush() == [sts.Packet(1, sts.PING, b"")]
    assert (framer.good, framer.corrupt, framer.skipped) == (1, 2, 2 * len(spoilt))


def test_too_long_is_no_frame_however_it_arrives():
    longest = line.sentence("x" * 76)
    framer = line.Lines()
    assert [fields for piece in (longest[:-1], b"more", b"\n", longest) for fields in framer.feed(piece)] == [("x" * 76,)]
    framer = line.Lines()
    assert framer.feed(b"$" + b"x" * 77 + b"*78\r\n") == [] and framer.corrupt == 1


def test_a_sentence_cut_short_is_corrupt_and_costs_no_other():
    framer = line.Lines()
    assert framer.feed(b"$NOSE,1,A" + line.sentence("NOSE", "2")) == [("NOSE", "2")]
    assert (framer.good, framer.corrupt, framer.skipped) == (1, 1, 9)


def test_a_star_within_a_sentence_is_refused():
    assert line.Lines().feed(b"$A*B*29\r\n" + b"$A,B*2F\r\n") == [("A", "B")]


def test_a_third_ff_before_a_packet_delays_nothing():
    assert sts.Packets().feed(b"\xff" + sts.ping(6)) == [sts.Packet(6, sts.PING, b"")]


@pytest.mark.parametrize("head", ["0200", "030055", "FB03", "FD03"])
def test_dynamixel_lengths_that_no_packet_has(head):
    """Too short for an instruction or for the error of a status, or beyond the longest; the CRC is right."""
    packet = bytes.fromhex("FFFFFD0001" + head)
    packet += bytes(5 + int.from_bytes(packet[5:7], "little") - len(packet))
    framer = dynamixel.Packets()
    assert framer.feed(packet + dynamixel.crc16(packet).to_bytes(2, "little")) == []
    assert framer.held < 7 and framer.feed(dynamixel.ping(1)) == [dynamixel.Packet(1, dynamixel.PING, 0, b"")]
