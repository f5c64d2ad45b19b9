"""A finished log, read back as the records that were written: in written order, bit for bit, in constant memory."""

import os
from collections.abc import Callable, Generator, Iterator
from pathlib import Path
from typing import TypeVar

from mcap.reader import make_reader
from mcap.records import Attachment, Message

from oio.core.errors import BadInput
from oio.core.records import Array, Belief, Event, GasReading, Innovation, WorldSample, seconds
from oio.log import decode
from oio.log.record_scanner import DAMAGE, Picker, records, written
from oio.log.scene import hypotheses
from oio.log.validation import check, refuse_damaged

T = TypeVar("T")


def read_samples(path: Path, since_ns: int = -1, until_ns: int | None = None) -> Generator[WorldSample, None, None]:
    """What the run's world yielded, and its commands, with since_ns < t_ns <= until_ns.

    Raises BadInput at the call for a file that is no finished OIO log, and on the way for a damaged one.
    """
    check(path)
    return _samples(_whole(path, Picker(decode.SAMPLES, since_ns, until_ns)))


def samples_written(path: Path, size: int, since_ns: int = -1, until_ns: int | None = None) -> Iterator[WorldSample]:
    """The same from the first `size` bytes of a log that is still being written; only its writer knows a good `size`."""
    return _samples(written(path, size, Picker(decode.SAMPLES, since_ns, until_ns)))


def _samples(picked: Iterator[tuple[str, Message]]) -> Generator[WorldSample, None, None]:
    for kind, message in picked:
        sample = decode.SAMPLES[kind](message.log_time, message.data)
        if not (isinstance(sample, Event) and sample.kind == "progress"):  # said by a stage to a person, not by the world
            yield sample


def read_beliefs(path: Path) -> Iterator[Belief]:
    """Every belief of the run; errors as `read_samples`."""
    return _of_kind(path, "oio.v1.State", decode.belief)


def read_innovations(path: Path) -> Iterator[Innovation]:
    """Every innovation of the run; errors as `read_samples`."""
    return _of_kind(path, "oio.v1.Innovation", decode.innovation)


def read_states(path: Path) -> Iterator[tuple[tuple[str, ...], Belief]]:
    """Every belief of the run with the names of its n entries, e.g. `source_x`; errors as `read_samples`."""
    return _of_kind(path, "oio.v1.State", decode.named_belief)


def read_readings(path: Path) -> Iterator[GasReading]:
    """Every raw sample that a stage turned into ppm; errors as `read_samples`."""
    return _of_kind(path, "oio.v1.GasReading", decode.reading)


def read_odometry(path: Path) -> Iterator[tuple[int, Array, Array]]:
    """(t_ns, nose (3,) m, covariance (3, 3) m^2) of every believed nose, in frame base; errors as `read_samples`."""
    return _of_kind(path, "foxglove.Odometry", decode.odometry)


def read_stages(path: Path) -> Iterator[tuple[int, str, str]]:
    """(t_ns, stage, `begin` | `end` | `failed`) in written order; errors as `read_samples`."""
    return _of_kind(path, "oio.v1.StageResult", decode.stage)


def read_hypotheses(path: Path) -> Iterator[tuple[int, list[tuple[Array, Array]]]]:
    """(t_ns, hypotheses of the source, best first, each (3,) m and (3, 3) m^2) as the viewer got them; errors as `read_samples`."""
    return _of_kind(path, "foxglove.SceneUpdate", hypotheses)


def _of_kind(path: Path, kind: str, record: Callable[[int, bytes], T]) -> Iterator[T]:
    check(path)
    return (record(message.log_time, message.data) for _, message in _whole(path, Picker((kind,))))


def _whole(path: Path, picker: Picker) -> Iterator[tuple[str, Message]]:
    last_ns = 0
    with path.open("rb") as file:
        try:
            for kind, message in picker.pick(records(file, os.fstat(file.fileno()).st_size)):
                last_ns = message.log_time
                yield kind, message
        except DAMAGE as error:
            refuse_damaged(path, f"after {seconds(last_ns):.3f} s: {error or type(error).__name__}")


def read_metadata(path: Path) -> dict[str, str]:
    """What the run was: `sensor`, `dof`, `joints`, `schema_version` and whatever else it was given."""
    return check(path)


def read_end(path: Path) -> int:
    """The time up to which the run went on, in ns: at least that of its last sample."""
    check(path)
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None and summary.statistics is not None  # `check` found the summary as it was written
    return summary.statistics.message_end_time


def read_attachment(path: Path, name: str) -> bytes:
    """An attached file, the latest of that name; raises BadInput if there is none, with the names that exist."""
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
