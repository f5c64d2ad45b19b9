"""Records of a damaged MCAP file: where a length or a checksum is wrong, the scan goes on at the next chunk or attachment that is sound."""

import re
import struct
import zlib
from collections.abc import Iterator
from io import BytesIO
from itertools import pairwise
from mmap import mmap

from mcap.opcode import Opcode
from mcap.records import Attachment, Chunk, DataEnd, McapRecord
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.writer import MCAP0_MAGIC

from oio.log.record_scanner import DAMAGE

HEAD = struct.Struct("<BQ")  # opcode, length
PRIVATE = 0x80  # opcodes from here on are for private use
_CHECKED = re.compile(bytes([0x5B, Opcode.CHUNK, Opcode.ATTACHMENT, 0x5D]), re.DOTALL)  # first byte of a record with a checksum of its own
_U32, _U64 = struct.Struct("<I"), struct.Struct("<Q")
_CHUNK_HEAD, _ATTACHMENT_HEAD = 28, 16  # bytes before the first length inside


class ResynchronisedRecords:
    """Iterates over the sound records of the data section, chunks still packed.

    A record is sound if its length is that of its contents. Where it is not, the next chunk or attachment is looked for whose opcode,
    inner lengths and CRC agree; a chunk of which only the outer length was damaged is found that way itself.
    """

    def __init__(self, data: mmap) -> None:
        self._data = data
        self.ended = False  # whether the end of the data was reached without a gap, and all checksums hold

    def __iter__(self) -> Iterator[McapRecord]:
        at, gaps = len(MCAP0_MAGIC), False
        while at < len(self._data):
            end = self._framed(at)
            if end is None:
                gaps = True
                found = self._next_checked(at)
                if found is None:
                    return
                at, end = found
            record = _parsed(_framed_anew(self._data[at:end]))
            if record is not None:
                yield record
            if isinstance(record, DataEnd):
                self.ended = not gaps and record.data_section_crc in (0, self._crc(at))
                return
            at = end

    def _framed(self, at: int) -> int | None:
        """End of the record at a position, or None if its length is not that of its contents."""
        if at + HEAD.size > len(self._data):
            return None
        opcode, length = HEAD.unpack_from(self._data, at)
        end = at + HEAD.size + length
        if end > len(self._data) or not (Opcode.HEADER <= opcode <= Opcode.DATA_END or opcode >= PRIVATE):
            return None
        if opcode in _LENGTH_OF:
            return end if _LENGTH_OF[opcode](self._data, at + HEAD.size) == length else None
        return end if opcode >= PRIVATE or _parsed(self._data[at:end]) is not None else None

    def _next_checked(self, at: int) -> tuple[int, int] | None:
        """Begin and end of the next record with a checksum that holds."""
        for match in _CHECKED.finditer(self._data, at):
            begin = match.start()
            length = _LENGTH_OF[self._data[begin]](self._data, begin + HEAD.size)
            end = begin + HEAD.size + (length or 0)
            if length is not None and end <= len(self._data) and _checksum_holds(_framed_anew(self._data[begin:end])):
                return begin, end
        return None

    def _crc(self, until: int, block: int = 1 << 20) -> int:
        """Checksum of all bytes before a position."""
        crc = 0
        for begin, end in pairwise([*range(0, until, block), until]):
            crc = zlib.crc32(self._data[begin:end], crc)
        return crc


def _parsed(framed: bytes) -> McapRecord | None:
    """One record; None if it cannot be read, or not with the length it claims."""
    stream = BytesIO(framed)
    try:
        record = next(iter(StreamReader(stream, skip_magic=True, emit_chunks=True).records))
    except (*DAMAGE, StopIteration):
        return None
    return record if stream.tell() == len(framed) else None


def _framed_anew(framed: bytes) -> bytes:
    """A record with the length that it has, in place of one that may be damaged."""
    return HEAD.pack(framed[0], len(framed) - HEAD.size) + framed[HEAD.size :]


def _checksum_holds(framed: bytes) -> bool:
    """Whether a chunk or an attachment is sound."""
    record = _parsed(framed)
    if isinstance(record, Attachment):
        (crc,) = _U32.unpack(framed[-_U32.size :])
        return bool(crc != 0 and zlib.crc32(framed[HEAD.size : -_U32.size]) == crc)
    if not isinstance(record, Chunk) or record.compression not in ("", "lz4", "zstd") or record.uncompressed_crc == 0:
        return False
    try:
        return bool(breakup_chunk(record, validate_crc=True))
    except DAMAGE:
        return False


def _chunk_length(data: mmap, at: int) -> int | None:
    """Length of a chunk's contents by the lengths of its compression and of its records."""
    return _inner_length(data, at + _CHUNK_HEAD, strings=1, tail=0, begin=at)


def _attachment_length(data: mmap, at: int) -> int | None:
    """Length of an attachment's contents by the lengths of its name, media type and data."""
    return _inner_length(data, at + _ATTACHMENT_HEAD, strings=2, tail=_U32.size, begin=at)


def _inner_length(data: mmap, at: int, strings: int, tail: int, begin: int) -> int | None:
    for _ in range(strings):
        if at + _U32.size > len(data):
            return None
        at += _U32.size + _U32.unpack_from(data, at)[0]
    if at + _U64.size > len(data):
        return None
    return int(at + _U64.size + _U64.unpack_from(data, at)[0] + tail - begin)


_LENGTH_OF = {int(Opcode.CHUNK): _chunk_length, int(Opcode.ATTACHMENT): _attachment_length}
