"""What is sound in a log without its end, or with bytes that are not as they were written."""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from mcap.records import Chunk, DataEnd, McapRecord, Message
from mcap.stream_reader import breakup_chunk

from oio.log.record_scanner import DAMAGE, records


@dataclass(slots=True)
class Salvage:
    """What was found: how many messages, until when [ns], and whether nothing is missing."""

    messages: int = 0
    until_ns: int = 0
    complete: bool = False

    def count(self, message: Message) -> None:
        """One more message was found."""
        self.messages += 1
        self.until_ns = max(self.until_ns, message.log_time)


def survey(path: Path) -> Salvage:
    """What could be kept of a file, without writing anything."""
    found = Salvage()
    for record in sound_records(path, found):
        if isinstance(record, Message):
            found.count(record)
    return found


def sound_records(path: Path, found: Salvage) -> Iterator[McapRecord]:
    """Records with chunks opened; a chunk that fails its checksum is passed over, a broken record is the end.

    At the end `found.complete` says whether that was everything.
    """
    whole = True
    with path.open("rb") as file:
        try:
            for record in records(file, os.fstat(file.fileno()).st_size, ended=False):
                inside = _opened(record)
                whole &= inside is not None
                yield from inside or ()
                found.complete = whole and isinstance(record, DataEnd)
        except DAMAGE:
            return


def _opened(record: McapRecord) -> list[McapRecord] | None:
    try:
        return breakup_chunk(record, validate_crc=True) if isinstance(record, Chunk) else [record]
    except DAMAGE:
        return None
