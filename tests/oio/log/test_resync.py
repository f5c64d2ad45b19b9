"""One wrong byte costs one chunk, wherever it is: behind a damaged length the scan finds the next record that is sound."""

import random
import struct
from pathlib import Path

import pytest
from mcap.opcode import Opcode

from oio.core.records import SECOND_NS, GasSample
from oio.log import RunLog, read_attachment, read_samples
from oio.log.damage_survey import survey
from oio.log.salvage import salvage

PER_S, FOR_S = 10, 30
TOTAL = PER_S * FOR_S


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """A log of 30 chunks of 10 messages, with an attachment at the begin and one in the middle."""
    path = tmp_path_factory.mktemp("whole") / "run.mcap"
    with RunLog.create(path, sensor="ec", joints=("a",), metadata={}, attachments={"config.yaml": b"dof: 1"}) as log:
        for i in range(1, TOTAL + 1):
            if i == TOTAL // 2:
                log.attach("calibration.yaml", b"chunks of \x06 and \x09 " * 50)
            log.write(GasSample(i * SECOND_NS // PER_S, 0, i * 0.1))
    return path.read_bytes()


def begins(whole: bytes, opcode: Opcode) -> list[int]:
    """Where the records of a kind begin in the data section, by walking over it."""
    at, found = 8, []
    while whole[at] != Opcode.DATA_END:
        found += [at] if whole[at] == opcode else []
        at += 9 + struct.unpack_from("<Q", whole, at + 1)[0]
    return found


def kept(tmp_path: Path, data: bytes) -> int:
    """Messages that a salvage keeps; each of them is as it was written."""
    path, out = tmp_path / "damaged.mcap", tmp_path / "out.mcap"
    path.write_bytes(data)
    out.unlink(missing_ok=True)
    found = salvage(path, out)
    assert not found.complete
    samples = list(read_samples(out))
    assert all(isinstance(s, GasSample) and s.raw == s.t_ns * PER_S // SECOND_NS * 0.1 for s in samples)
    assert len(samples) == found.messages
    return found.messages


@pytest.mark.parametrize("byte", range(1, 9))
@pytest.mark.parametrize("flip", [0x01, 0x80])
def test_a_flipped_length_of_a_chunk_costs_nothing(whole: bytes, tmp_path: Path, byte: int, flip: int) -> None:
    """The chunk itself is whole: its inner lengths and its checksum say so."""
    data = bytearray(whole)
    data[begins(whole, Opcode.CHUNK)[12] + byte] ^= flip
    assert kept(tmp_path, bytes(data)) == TOTAL


@pytest.mark.parametrize("opcode", [Opcode.MESSAGE_INDEX, Opcode.ATTACHMENT])
@pytest.mark.parametrize("byte", [1, 2, 3, 8])
def test_a_flipped_length_of_another_record_swallows_no_chunk(whole: bytes, tmp_path: Path, opcode: Opcode, byte: int) -> None:
    data = bytearray(whole)
    data[begins(whole, opcode)[-1] + byte] ^= 1
    assert kept(tmp_path, bytes(data)) == TOTAL
    assert read_attachment(tmp_path / "out.mcap", "calibration.yaml") == b"chunks of \x06 and \x09 " * 50


def test_any_wrong_byte_costs_two_chunks_at_most(whole: bytes, tmp_path: Path) -> None:
    """Two: between chunks the search may begin within the next record."""
    first, last = begins(whole, Opcode.CHUNK)[0], begins(whole, Opcode.CHUNK)[-1]
    draws = random.Random(0)
    for _ in range(150):
        data = bytearray(whole)
        data[draws.randrange(first, last)] ^= 1 << draws.randrange(8)
        path = tmp_path / "damaged.mcap"
        path.write_bytes(data)
        assert TOTAL - 2 * PER_S <= survey(path).messages <= TOTAL


def test_a_hole_costs_what_was_in_it(whole: bytes, tmp_path: Path) -> None:
    chunks = begins(whole, Opcode.CHUNK)
    data = whole[: chunks[5] + 20] + bytes(5000) + whole[chunks[8] + 3 :]  # zeros, as of a disk that lost power
    assert TOTAL - 4 * PER_S <= kept(tmp_path, data) < TOTAL


def test_a_whole_log_is_complete(whole: bytes, tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    path.write_bytes(whole)
    found = survey(path)
    assert found.complete and found.messages == TOTAL
    path.write_bytes(whole[:-200])  # without its index
    assert survey(path).messages == TOTAL
