"""Damage survey: which records are intact in a log that is truncated or corrupted."""

from collections.abc import Iterator
from dataclasses import dataclass
from mmap import ACCESS_READ, mmap
from pathlib import Path

from mcap.records import Chunk, McapRecord, Message, Metadata
from mcap.stream_reader import breakup_chunk

from oio.log.part_file import METADATA
from oio.log.record_scanner import DAMAGE
from oio.log.resync import ResynchronisedRecords
from oio.log.wall_clock import start_ns


@dataclass(slots=True)
class RecoveryReport:
    """Recovery report: how many messages were found, the time of the last one [ns], and whether nothing is missing."""

    messages: int = 0
    until_ns: int = 0
    complete: bool = False
    start_ns: int = 0  # from 1970 to the world's opening, from which `until_ns` counts

    def count(self, message: Message) -> None:
        """Count one message."""
        self.messages += 1
        self.until_ns = max(self.until_ns, message.log_time - self.start_ns)


def survey(path: Path) -> RecoveryReport:
    """Return what could be recovered of a file, without writing anything."""
    found = RecoveryReport()
    for record in intact_records(path, found):
        if isinstance(record, Message):
            found.count(record)
    return found


def intact_records(path: Path, found: RecoveryReport) -> Iterator[McapRecord]:
    """Yield the intact records, with chunks unpacked; a chunk that fails its checksum is skipped, behind a damaged length the scan goes on
    at the next sound one.

    At the end `found.complete` is True if that was everything.
    """
    with path.open("rb") as file, mmap(file.fileno(), 0, access=ACCESS_READ) as data:
        intact, sound = True, ResynchronisedRecords(data)
        for record in sound:
            if isinstance(record, Metadata) and record.name == METADATA:
                found.start_ns = start_ns(record.metadata)
            unpacked = _unpacked(record)
            intact &= unpacked is not None
            yield from unpacked or ()
        found.complete = intact and sound.ended


def _unpacked(record: McapRecord) -> list[McapRecord] | None:
    """Records of a chunk, or the record itself; None if its checksum or its framing is wrong."""
    try:
        return breakup_chunk(record, validate_crc=True) if isinstance(record, Chunk) else [record]
    except DAMAGE:
        return None
