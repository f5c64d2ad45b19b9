"""Log validation: is a file a complete, intact OIO log? Every error names the input, what is allowed and a command to type."""

import os
import struct
import zlib
from pathlib import Path
from typing import IO, NoReturn

from mcap.records import Chunk, Metadata
from mcap.writer import MCAP0_MAGIC

from oio.core.errors import BadInput
from oio.core.records import seconds
from oio.log.damage_survey import survey
from oio.log.part_file import METADATA
from oio.log.record_scanner import DAMAGE, records
from oio.log.schemas import SCHEMA_VERSION
from oio.log.wall_clock import start_ns

_FOOTER = struct.Struct("<BQQQI")  # opcode, length, start of the summary, of its offsets, CRC of the summary
_DATA_END = struct.Struct("<BQ")  # opcode, length; a CRC of all data follows
_DATA_END_SIZE = _DATA_END.size + 4
_TAIL = _FOOTER.size + len(MCAP0_MAGIC)
_EXAMPLE = "Give the log of an OIO run, e.g. outputs/2026-01-31/12-00-00/run.mcap."


def check(path: Path) -> dict[str, str]:
    """Return the metadata of a finished OIO log; raises BadInput for anything else. Reads the two ends of the file only."""
    refuse_foreign(path)
    sound = index_is_sound(path)
    if sound is None:
        refuse_truncated(path)
    if not sound:
        refuse_damaged(path, "its index does not match its checksum")
    return metadata(path)


def index_is_sound(path: Path) -> bool | None:
    """Return whether the index at the end of the file matches its checksum; None if the file is truncated."""
    with path.open("rb") as file:
        size = file.seek(0, os.SEEK_END)
        return _summary_crc_matches(file, size) if _has_end_magic(file, size) else None


def refuse_foreign(path: Path) -> None:
    """Raise BadInput unless this is a file that begins as an MCAP."""
    if not path.is_file():
        what = "it is a folder" if path.is_dir() else "there is no such file"
        raise BadInput(f"{path} was given as a log, but {what}. {_EXAMPLE}")
    with path.open("rb") as file:
        if file.read(len(MCAP0_MAGIC)) != MCAP0_MAGIC:
            raise BadInput(f"{path} was given as a log, but it is not an MCAP file. {_EXAMPLE}")


def metadata(path: Path) -> dict[str, str]:
    """Return the record `oio.run`, finished log or not; raises BadInput if there is none or its schema version is another."""
    found = _find_metadata(path)
    if found is None:
        raise BadInput(f"{path} is an MCAP file, but without the record '{METADATA}': it was not written by OIO. {_EXAMPLE}")
    try:
        start_ns(found)
    except ValueError as error:
        refuse_damaged(path, str(error))
    version = found.get("schema_version", "none")
    if version != SCHEMA_VERSION:
        raise BadInput(
            f"{path} has schema_version {version}, but this OIO reads {SCHEMA_VERSION} only. "
            f"Read it with the OIO that wrote it: pip install oio=={found.get('oio', 'VERSION')}"
        )
    return found


def _find_metadata(path: Path) -> dict[str, str] | None:
    with path.open("rb") as file:
        try:
            for record in records(file, path.stat().st_size, ended=False):
                if isinstance(record, Metadata) and record.name == METADATA:
                    return dict(record.metadata)
                if isinstance(record, Chunk):
                    return None  # an OIO log has its metadata before its first sample
        except DAMAGE as error:
            refuse_damaged(path, f"before its first sample: {error or type(error).__name__}")
    return None


def _has_end_magic(file: IO[bytes], size: int) -> bool:
    if size < _TAIL:
        return False
    file.seek(size - len(MCAP0_MAGIC))
    return file.read() == MCAP0_MAGIC


def _summary_crc_matches(file: IO[bytes], size: int) -> bool:
    file.seek(size - _TAIL)
    footer = file.read(_FOOTER.size)
    opcode, _, start, _, crc = _FOOTER.unpack(footer)
    if opcode != 2 or not _DATA_END_SIZE < start <= size - _TAIL:
        return False
    file.seek(start - _DATA_END_SIZE)
    if _DATA_END.unpack(file.read(_DATA_END.size)) != (15, 4):  # DataEnd is covered by neither the data's checksum nor the summary's
        return False
    file.seek(start)
    summary = file.read(size - _TAIL - start)
    return bool(zlib.crc32(footer[:-4], zlib.crc32(summary)) == crc)  # the CRC covers the footer up to itself


def refuse_truncated(path: Path) -> NoReturn:
    """Raise BadInput for a log without its end, with the time up to which it can be read."""
    raise BadInput(
        f"{path} has no end: the run was killed, is still going on, or the copy broke off. It is readable until "
        f"{seconds(survey(path).until_ns):.3f} s. Only finished logs are read. Type `python -m oio.recover {path}` to make one of it."
    )


def refuse_damaged(path: Path, how: str) -> NoReturn:
    """Raise BadInput for a corrupted log."""
    raise BadInput(
        f"{path} is damaged ({how}), and only a log that is bit for bit as it was written is read. "
        f"Copy it again, or type `python -m oio.recover {path}` to keep what is sound."
    )
