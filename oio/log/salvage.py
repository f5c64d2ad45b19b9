"""Log recovery: a finished log from a truncated or corrupted one; every record that `survey` finds intact is copied."""

import os
from itertools import chain
from pathlib import Path

from mcap.reader import make_reader
from mcap.records import Attachment, Channel, McapRecord, Message, Metadata, Schema
from mcap.writer import Writer

from oio.core.errors import BadInput
from oio.log.damage_survey import RecoveryReport, intact_records, survey
from oio.log.part_file import open_writer
from oio.log.validation import index_is_sound, metadata, refuse_foreign


def recover(path: Path, out: Path) -> int:
    """Copy every intact record of `path` to the finished log `out`; returns the number of messages kept, 0 if there are none.

    `path` is only read; raises BadInput if it is no OIO log or `out` exists.
    """
    return salvage(path, out).messages


def salvage(path: Path, out: Path) -> RecoveryReport:
    """`recover`, returning the full recovery report; `out` is not created if no message was kept."""
    refuse_foreign(path)
    if out.exists():
        raise BadInput(f"{out} is there already, and a log is never overwritten. Type `python -m oio.recover {path} OUT` with another OUT.")
    if survey(path).messages == 0:
        return RecoveryReport()
    metadata(path)
    unfinished = out.with_name(out.name + ".unfinished")
    with unfinished.open("wb") as file:
        found = _copy(path, open_writer(file))
        file.flush()
        os.fsync(file.fileno())
    if found.messages:
        unfinished.rename(out)
    else:
        unfinished.unlink()
    return found


def _copy(path: Path, writer: Writer) -> RecoveryReport:
    found = RecoveryReport()
    copier = _Copier(writer)
    for record in chain(_declared(path), intact_records(path, found)):
        if copier.copied(record) and isinstance(record, Message):
            found.count(record)
    writer.finish()  # type: ignore[no-untyped-call]
    found.complete &= not copier.orphans
    return found


def _declared(path: Path) -> list[McapRecord]:
    """Schemas and channels as repeated in the index, so that a lost first chunk does not lose all messages."""
    if not index_is_sound(path):
        return []
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    return [*summary.schemas.values(), *summary.channels.values()] if summary else []


class _Copier:
    """Copies records to another file, where schemas and channels get new ids."""

    def __init__(self, writer: Writer) -> None:
        self._writer = writer
        self._schemas: dict[int, int] = {}
        self._channels: dict[int, int] = {}
        self.orphans = 0  # number of messages whose channel was lost

    def copied(self, record: McapRecord) -> bool:
        """Copy one record; False for a message whose channel was lost."""
        writer = self._writer
        match record:
            case Schema() if record.id not in self._schemas:
                self._schemas[record.id] = writer.register_schema(record.name, record.encoding, record.data)
            case Channel() if record.id not in self._channels:
                self._channel(record)
            case Message():
                return self._message(record)
            case Metadata():
                writer.add_metadata(record.name, record.metadata)
            case Attachment():
                writer.add_attachment(record.create_time, record.log_time, record.name, record.media_type, record.data)
        return True

    def _channel(self, channel: Channel) -> None:
        schema = self._schemas.get(channel.schema_id, 0)
        self._channels[channel.id] = self._writer.register_channel(channel.topic, channel.message_encoding, schema, channel.metadata)

    def _message(self, message: Message) -> bool:
        if message.channel_id not in self._channels:
            self.orphans += 1
            return False
        channel = self._channels[message.channel_id]
        self._writer.add_message(channel, message.log_time, message.data, message.publish_time, message.sequence)
        return True
