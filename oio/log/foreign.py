"""Messages of any MCAP log as text tables, whoever wrote them: JSON, Protobuf, and ROS 2 (CDR, with the package mcap-ros2-support).

A table has a row per message of one topic. Its columns are `log_time [ns]`, the numbers of the messages by their path (`/co2.data`,
`/joint_states.position.shoulder_pan`), and those of the other topics, interpolated linearly to the rows' log times.
"""

import io
import json
import struct
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from google.protobuf.message import DecodeError
from mcap.exceptions import McapError
from mcap.reader import NonSeekingReader
from mcap_protobuf.decoder import DecoderFactory as ProtobufDecoders

from oio.core.errors import BadInput
from oio.core.records import Array
from oio.log.plain_numbers import numbers

TIME = "log_time [ns]"
ROS2 = "ROS 2 messages need the package mcap-ros2-support. Type pip install 'oio[ros2]'."
Decode = Callable[[bytes], Any]
DAMAGE = (McapError, struct.error, ValueError, EOFError, KeyError, RecursionError)
NOT_DECODED = (
    McapError,
    ValueError,
    TypeError,
    KeyError,
    IndexError,
    struct.error,
    RecursionError,
    DecodeError,
)  # raised by decoders


@dataclass(eq=False)
class Topic:
    """Numbers of one topic: log times [ns], and its columns (k,), NaN in messages that lack one."""

    t_ns: list[int] = field(default_factory=list)
    columns: dict[str, list[float]] = field(default_factory=dict)

    def add(self, t_ns: int, values: Mapping[str, float]) -> None:
        """Add a message."""
        k = len(self.t_ns)
        self.t_ns.append(t_ns)
        for name in (*self.columns, *(name for name in values if name not in self.columns)):
            self.columns.setdefault(name, [np.nan] * k).append(values.get(name, np.nan))


def topics(data: bytes, name: str) -> tuple[dict[str, Topic], dict[str, str]]:
    """Return the topics that hold numbers, and of those that cannot be decoded why. Raises BadInput for a damaged log called `name`."""
    found, undecoded, broken = dict[str, Topic](), dict[str, str](), Counter[str]()
    decoders = dict[int, Decode | None]()
    try:
        for schema, channel, message in NonSeekingReader(io.BytesIO(data), validate_crcs=True).iter_messages():
            if channel.id not in decoders:
                decoders[channel.id] = _decoder(channel.message_encoding, schema)
            decode = decoders[channel.id]
            if decode is None:
                undecoded[channel.topic] = ROS2 if channel.message_encoding == "cdr" else f"its encoding is '{channel.message_encoding}'"
                continue
            try:
                values = numbers(decode(message.data))
            except NOT_DECODED:
                broken[channel.topic] += 1
                values = {}  # a row without a number, which is dropped and counted as such
            found.setdefault(channel.topic, Topic()).add(message.log_time, {f"{channel.topic}.{k}": v for k, v in values.items()})
    except DAMAGE as error:
        why = str(error) or "it ends in the middle of a record"
        raise BadInput(
            f"{name} is an MCAP log that cannot be read to its end ({why}). What is whole in it can be kept with the tool of the format: "
            f"mcap recover {name}."
        ) from None
    for topic in [topic for topic, table in found.items() if not table.columns]:
        count = len(found.pop(topic).t_ns)
        undecoded[topic] = f"none of its {count} messages can be decoded" if broken[topic] == count else "its messages hold no numbers"
    return found, undecoded


def _decoder(encoding: str, schema: Any) -> Decode | None:
    if encoding == "json":
        return json.loads
    for factory in (ProtobufDecoders(), _ros2()):
        if factory is not None and (decode := factory.decoder_for(encoding, schema)) is not None:
            return decode
    return None


def _ros2() -> Any | None:
    try:
        from mcap_ros2.decoder import DecoderFactory  # type: ignore[import-not-found,unused-ignore]
    except ImportError:
        return None
    return DecoderFactory()


def as_csv(data: bytes, name: str, rows_of: str | None) -> bytes:
    """Return the table of the topic that has the column `rows_of` (None: of the only topic with numbers) as CSV.

    Raises BadInput, with the topics and their columns, where none or another is wanted.
    """
    found, undecoded = topics(data, name)
    chosen = _chosen(found, undecoded, name, rows_of)
    t_ns = np.array(found[chosen].t_ns)
    columns: dict[str, Array] = {column: np.array(values) for column, values in found[chosen].columns.items()}
    for other, topic in found.items():
        if other != chosen:
            columns |= {column: _interpolated(t_ns, np.array(topic.t_ns), np.array(values)) for column, values in topic.columns.items()}
    lines = [",".join(json.dumps(column, ensure_ascii=False) if "," in column else column for column in (TIME, *columns))]
    rows = zip(t_ns.tolist(), *(column.tolist() for column in columns.values()), strict=True)
    lines += [",".join(map(repr, row)) for row in rows]
    return "\n".join([*lines, ""]).encode()


def _interpolated(t_ns: Array, own_ns: Array, values: Array) -> Array:
    """Values (k,) of another topic at t_ns (j,); NaN before its first and after its last."""
    good = np.isfinite(values)
    if not np.any(good):
        return np.full(len(t_ns), np.nan)
    since = own_ns[0]  # differences of whole nanoseconds are exact, their floating-point values since 1970 are not
    order = np.argsort(own_ns[good], kind="stable")
    at: Array = np.interp(t_ns - since, (own_ns[good] - since)[order], values[good][order], np.nan, np.nan)
    return at


def _chosen(found: Mapping[str, Topic], undecoded: Mapping[str, str], name: str, rows_of: str | None) -> str:
    having = [topic for topic, table in found.items() if rows_of in table.columns]
    if having:
        return having[0]
    if rows_of is None and len(found) == 1:
        return next(iter(found))
    if not found:
        why = "; ".join(f"{topic}: {reason}" for topic, reason in undecoded.items())
        raise BadInput(f"{name} is an MCAP log without numbers that can be read ({why or 'it has no messages'}).")
    listed = "; ".join(f"{topic} ({len(table.t_ns)} messages): {', '.join(list(table.columns)[:12])}" for topic, table in found.items())
    said = "it is not certain which topic holds the readings" if rows_of is None else f"none of its topics has '{rows_of}'"
    example = next(reversed(min(found.values(), key=lambda table: len(table.columns)).columns))
    missed = "".join(f" {topic} is left out: {reason}" for topic, reason in undecoded.items())
    raise BadInput(f"{name} is an MCAP log, and {said}. They are {listed}. Type e.g. 'recording.columns=[\"{example}\"]'.{missed}")
