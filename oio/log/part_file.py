"""Log file being written: `<path>.part`, flushed once a second to a state that survives a crash."""

import os
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from mcap.well_known import MessageEncoding
from mcap.writer import CompressionType, Writer
from mcap_protobuf.schema import register_schema

from oio.core.errors import BadInput
from oio.core.records import SECOND_NS
from oio.log.wall_clock import shift, start_ns

CHUNK_BYTES = 256 * 1024
METADATA = "oio.run"


LogCall = Callable[["PartialLogFile"], Any]


@dataclass(slots=True)
class _Channel:
    id: int
    sequence: int = 0


def open_writer(file: Any) -> Writer:
    """Return an MCAP writer with the settings of every OIO log, its header written."""
    writer = Writer(file, chunk_size=CHUNK_BYTES, compression=CompressionType.ZSTD, enable_data_crcs=True)
    writer.start()
    return writer


class PartialLogFile:
    """Unfinished log file. Its chunk boundaries depend on the data and never on the wall clock.

    Memory grows only by the MCAP index of the file: one entry per chunk.
    """

    def __init__(self, path: Path, metadata: dict[str, str]) -> None:
        self.final, self.path = path, path.with_name(path.name + ".part")
        for taken in (self.final, self.path):
            if taken.exists():
                raise BadInput(f"{taken} is there already, and a log is never overwritten. Give another folder, or move that file away.")
        path.parent.mkdir(parents=True, exist_ok=True)
        self._file = self.path.open("xb")
        self._writer = open_writer(self._file)
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, _Channel] = {}
        self._t_ns = self._flushed_ns = 0
        self._due = False
        self._start_ns = start_ns(metadata)
        self._flushed_wall_s = time.monotonic()
        self._journal: list[LogCall] | None = None
        self._writer.add_metadata(METADATA, metadata)
        self.flush()  # the metadata of a run that crashes in its first second are kept

    def channel(self, topic: str, kind: Any) -> _Channel:
        """Return the channel of `topic` for messages of class `kind`; it is registered at first use."""
        if topic not in self._channels:
            name = kind.DESCRIPTOR.full_name
            if name not in self._schemas:
                self._schemas[name] = register_schema(self._writer, kind)
            self._channels[topic] = _Channel(self._writer.register_channel(topic, MessageEncoding.Protobuf, self._schemas[name]))
        return self._channels[topic]

    def put(self, topic: str, t_ns: int, message: Any, urgent: bool = False) -> None:
        """Append one message; both its MCAP times are the time of the record, since 1970 if the world has a time of day.

        `urgent`: somebody waits for what comes of it, so that a chunk that is due then is closed before the next message that is not, or of
        another time: that takes 2 ms.
        """
        if self._start_ns:
            shift(message, self._start_ns)
        self._append(topic, t_ns, type(message), message.SerializeToString(), urgent)

    def _append(self, topic: str, t_ns: int, kind: Any, data: bytes, urgent: bool) -> None:
        if self._journal is not None:
            self._journal.append(partial(PartialLogFile._append, topic=topic, t_ns=t_ns, kind=kind, data=data, urgent=urgent))
        if self._due and (not urgent or t_ns > self._t_ns):
            self._close_chunk()
        channel = self.channel(topic, kind)
        at_ns = self._start_ns + t_ns
        self._writer.add_message(channel.id, at_ns, data, at_ns, channel.sequence)
        channel.sequence += 1
        self._t_ns = max(self._t_ns, t_ns)
        self._due = self._t_ns - self._flushed_ns >= SECOND_NS
        if self._due and not urgent:
            self._close_chunk()
        elif time.monotonic() - self._flushed_wall_s >= 1.0:
            self._flush_file()

    def attach(self, name: str, data: bytes) -> None:
        """Append an attachment. At once, not at the end: the configuration of a crashed run is then in its log."""
        if self._journal is not None:
            self._journal.append(partial(PartialLogFile.attach, name=name, data=data))
        self._writer.add_attachment(0, self._start_ns + self._t_ns, name, "application/octet-stream", data)
        self._flush_file()

    def flush(self) -> int:
        """Close the chunk and pass all data to the operating system; returns the file size in bytes."""
        if self._journal is not None:
            self._journal.append(PartialLogFile.flush)
        self._close_chunk()
        return self._file.tell()

    def _close_chunk(self) -> None:
        self._writer.flush()  # type: ignore[no-untyped-call]
        self._flushed_ns, self._due = self._t_ns, False
        self._flush_file()

    def _flush_file(self) -> None:
        self._file.flush()
        self._flushed_wall_s = time.monotonic()

    def remember(self) -> None:
        """Keep in memory what is appended from now on."""
        self._journal = []

    def remembered(self) -> tuple[LogCall, ...]:
        """Return what was appended since `remember`, as calls that append it to another file."""
        return tuple(self._journal or ())

    def repeat(self, calls: Iterable[LogCall]) -> None:
        """Append what another file remembered: the same bytes, chunk by chunk."""
        for call in calls:
            call(self)

    def finish(self) -> None:
        """Write index and footer and close; the file name stays `.part`."""
        self._writer.finish()  # type: ignore[no-untyped-call]
        self._file.flush()
        os.fsync(self._file.fileno())
        self._file.close()

    def rename(self) -> None:
        """Rename the finished file to its final path."""
        self.path.rename(self.final)
