"""MCAP record scanner: selects messages by schema and time, one chunk in memory at a time, with every checksum verified."""

import struct
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import IO, cast

import zstandard
from mcap.exceptions import McapError
from mcap.records import Channel, Chunk, DataEnd, Footer, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import StreamReader, breakup_chunk

from oio.log.part_file import METADATA
from oio.log.wall_clock import start_ns

# What the parser raises on corrupted bytes; CRC and text errors are ValueErrors.
DAMAGE = (McapError, ValueError, struct.error, zstandard.ZstdError, MemoryError, OverflowError)


class _BoundedReader:
    """File reader limited to the first `size` bytes. mcap accepts a short read silently; here it raises ValueError."""

    def __init__(self, file: IO[bytes], size: int) -> None:
        self._file, self._bytes_left = file, size

    def read(self, count: int) -> bytes:
        """Read `count` bytes; raises before any memory is reserved if fewer are left."""
        if count > self._bytes_left:
            raise ValueError("a record goes beyond the end")
        self._bytes_left -= count
        return self._file.read(count)


def records(file: IO[bytes], size: int, ended: bool = True) -> Iterator[McapRecord]:
    """Yield the records of the data section, chunks still packed, and DataEnd last; raises one of DAMAGE if it is not reached.

    `size` is how many bytes of the file are read. Without DataEnd the checksum over all data cannot be verified: only a file that is
    not `ended` may stop after any complete record.
    """
    reader = StreamReader(cast(IO[bytes], _BoundedReader(file, size)), emit_chunks=True, validate_crcs=True, record_size_limit=size)
    for record in reader.records:
        if isinstance(record, Footer):
            break
        yield record
        if isinstance(record, DataEnd) or (not ended and file.tell() >= size):
            return
    raise ValueError("its data has no end")


class MessageFilter:
    """Message filter: selects the messages of certain schemas in a time window from a stream of records."""

    def __init__(self, kinds: Collection[str], since_ns: int = -1, until_ns: int | None = None) -> None:
        self._kinds, self._since_ns, self._until_ns = frozenset(kinds), since_ns, until_ns
        self._schemas: dict[int, str] = {}
        self._channels: dict[int, str] = {}
        self._start_ns = 0

    def pick(self, stream: Iterator[McapRecord]) -> Iterator[tuple[str, Message]]:
        """Yield (schema name, message) in written order with since_ns < log time <= until_ns; log times count from the world's opening."""
        for record in stream:
            if isinstance(record, Metadata) and record.name == METADATA:
                self._start_ns = start_ns(record.metadata)
            if isinstance(record, Chunk) and self._may_contain(record):
                for inner in breakup_chunk(record, validate_crc=True):
                    yield from self._select(inner)

    def _may_contain(self, chunk: Chunk) -> bool:
        if not self._kinds.issubset(self._channels.values()):
            return True  # it may declare a channel that later chunks use
        return self._in_window(chunk.message_end_time, chunk.message_start_time)

    def _in_window(self, late_ns: int, early_ns: int) -> bool:
        late_ns, early_ns = late_ns - self._start_ns, early_ns - self._start_ns
        return late_ns > self._since_ns and (self._until_ns is None or early_ns <= self._until_ns)

    def _select(self, record: McapRecord) -> Iterator[tuple[str, Message]]:
        match record:
            case Schema():
                self._schemas[record.id] = record.name
            case Channel():
                self._channels[record.id] = self._schemas.get(record.schema_id, "")
            case Message():
                kind = self._channels.get(record.channel_id)
                if kind in self._kinds and self._in_window(record.log_time, record.log_time):
                    record.log_time -= self._start_ns
                    yield kind, record


def messages_so_far(path: Path, size: int, picker: MessageFilter) -> Iterator[tuple[str, Message]]:
    """Yield the selected messages of the first `size` bytes of a file that is still being written."""
    with path.open("rb") as file:
        yield from picker.pick(records(file, size, ended=False))
