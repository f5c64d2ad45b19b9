"""Log reader: a finished log as the records that were written, in written order, bit for bit, in constant memory."""

import os
from collections.abc import Callable, Generator, Iterator, Mapping
from pathlib import Path
from typing import Any, TypeVar

from mcap.reader import make_reader
from mcap.records import Attachment, Message

from oio.core.errors import BadInput
from oio.core.records import Array, Belief, Event, FilterEstimate, GasReading, Innovation, WorldSample, seconds
from oio.log import decode
from oio.log.decode_entries import ENTRIES
from oio.log.entries import Entry
from oio.log.record_scanner import DAMAGE, MessageFilter, messages_so_far, records
from oio.log.scene import belief_scene
from oio.log.validation import check, refuse_damaged
from oio.log.wall_clock import start_ns

T = TypeVar("T")
BY_STAGES = ("progress", "bout", "verdict")  # kinds of events that stages write for the user: no part of the world, a replay makes its own


def read_samples(path: Path, since_ns: int = -1, until_ns: int | None = None) -> Generator[WorldSample, None, None]:
    """Return the world samples of the run (sensor data, truth, events) with since_ns < t_ns <= until_ns.

    Raises BadInput at the call for a file that is no finished OIO log, and during iteration for a damaged one.
    """
    check(path)
    return _decoded_samples(_selected(path, MessageFilter(decode.SAMPLES, since_ns, until_ns)))


def samples_written(path: Path, size: int, since_ns: int = -1, until_ns: int | None = None) -> Iterator[WorldSample]:
    """Return the same from the first `size` bytes of a log still being written; `size` must come from its writer."""
    return _decoded_samples(messages_so_far(path, size, MessageFilter(decode.SAMPLES, since_ns, until_ns)))


def _decoded_samples(picked: Iterator[tuple[str, Message]]) -> Generator[WorldSample, None, None]:
    for kind, message in picked:
        sample = decode.SAMPLES[kind](message.log_time, message.data)
        if not (isinstance(sample, Event) and sample.kind in BY_STAGES):
            yield sample


def read_beliefs(path: Path) -> Iterator[Belief]:
    """Return every belief of the run; errors as `read_samples`."""
    return _records_of_schema(path, "oio.v1.State", decode.belief)


def read_innovations(path: Path) -> Iterator[Innovation]:
    """Return every innovation of the run; errors as `read_samples`."""
    return _records_of_schema(path, "oio.v1.Innovation", decode.innovation)


def read_states(path: Path) -> Iterator[tuple[tuple[str, ...], Belief]]:
    """Return every belief of the run with the names of its n entries, e.g. `source_x`; errors as `read_samples`."""
    return _records_of_schema(path, "oio.v1.State", decode.named_belief)


def read_readings(path: Path) -> Iterator[GasReading]:
    """Return every calibrated reading in ppm; errors as `read_samples`."""
    return _records_of_schema(path, "oio.v1.GasReading", decode.reading)


def read_odometry(path: Path) -> Iterator[tuple[int, Array, Array]]:
    """Return (t_ns, nose (3,) m, covariance (3, 3) m^2) of every believed nose, in frame base; errors as `read_samples`."""
    return _records_of_schema(path, "foxglove.Odometry", decode.odometry)


def read_filter_estimates(path: Path) -> Iterator[FilterEstimate]:
    """Return what the other filters of the stage evaluate estimated, variant by variant in order of time; errors as `read_samples`."""
    return _records_of_schema(path, "oio.v1.FilterEstimate", decode.filter_estimate)


def read_events(path: Path) -> Iterator[Event]:
    """Return every event of the run, those of progress too; errors as `read_samples`."""
    return _records_of_schema(path, "oio.v1.Event", decode.event)


def read_stages(path: Path) -> Iterator[tuple[int, str, str]]:
    """Return (t_ns, stage, `begin` | `end` | `failed`) in written order; errors as `read_samples`."""
    return _records_of_schema(path, "oio.v1.StageResult", decode.stage)


def read_hypotheses(path: Path) -> Iterator[tuple[int, list[tuple[Array, Array]]]]:
    """Return (t_ns, hypotheses of the source, best first, each (3,) m and (3, 3) m^2) of every scene; errors as `read_samples`."""
    scenes = _records_of_schema(path, "foxglove.SceneUpdate", belief_scene)
    return ((scene.t_ns, scene.hypotheses) for scene in scenes if scene is not None)


def read_entries(path: Path) -> Iterator[Entry]:
    """Return all that a watcher of the run was told, in written order; errors as `read_samples`."""
    check(path)
    decoded = (ENTRIES[kind](message.log_time, message.data) for kind, message in _selected(path, MessageFilter(ENTRIES)))
    return (entry for entry in decoded if entry is not None)


def read_kinds(path: Path, decoders: Mapping[str, Callable[[int, bytes], Any]]) -> Iterator[tuple[str, Any]]:
    """Yield (schema, record) of several schemas in one pass, in written order; errors as `read_samples`."""
    check(path)
    return ((kind, decoders[kind](message.log_time, message.data)) for kind, message in _selected(path, MessageFilter(tuple(decoders))))


def _records_of_schema(path: Path, kind: str, record: Callable[[int, bytes], T]) -> Iterator[T]:
    check(path)
    return (record(message.log_time, message.data) for _, message in _selected(path, MessageFilter((kind,))))


def _selected(path: Path, picker: MessageFilter) -> Iterator[tuple[str, Message]]:
    last_ns = 0
    with path.open("rb") as file:
        try:
            for kind, message in picker.pick(records(file, os.fstat(file.fileno()).st_size)):
                last_ns = message.log_time
                yield kind, message
        except DAMAGE as error:
            refuse_damaged(path, f"after {seconds(last_ns):.3f} s: {error or type(error).__name__}")


def read_metadata(path: Path) -> dict[str, str]:
    """Return the metadata of the run: `sensor`, `dof`, `joints`, `schema_version` and any others it was given."""
    return check(path)


def read_end(path: Path) -> int:
    """Return the end time of the run [ns]: at least that of its last sample."""
    start = start_ns(check(path))
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None and summary.statistics is not None  # `check` has verified the summary's checksum
    return max(summary.statistics.message_end_time - start, 0)


def read_attachment(path: Path, name: str) -> bytes:
    """Return an attached file, the latest of that name; raises BadInput, with the names that exist, if there is none."""
    check(path)
    found: dict[str, bytes] = {}
    with path.open("rb") as file:
        try:
            for record in records(file, os.fstat(file.fileno()).st_size):
                if isinstance(record, Attachment):
                    found[record.name] = record.data if record.name == name else b""
        except DAMAGE as error:
            refuse_damaged(path, str(error) or type(error).__name__)
    if name not in found:
        raise BadInput(f"{path} has no attachment '{name}'. It has: {', '.join(sorted(found)) or 'none'}.")
    return found[name]
