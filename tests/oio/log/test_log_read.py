"""Reading a log back: every bit of every float, and a refusal for whatever is not a whole OIO log."""

import itertools
import math
import struct
import tempfile
import tracemalloc
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.writer import Writer

from oio.core.errors import BadInput
from oio.core.records import SECOND_NS, Belief, Event, FilterEstimate, GasSample, Innovation, JointState, Truth, WorldSample
from oio.log import (
    RunLog,
    read_attachment,
    read_beliefs,
    read_end,
    read_filter_estimates,
    read_innovations,
    read_metadata,
    read_odometry,
    read_run,
    read_samples,
)

GIVE = "Give the log of an OIO run, e.g. outputs/2026-01-31/12-00-00/run.mcap."
ODD = [-0.0, 5e-324, -2.2250738585072009e-308, math.inf, -math.inf, math.nan, 1.7976931348623157e308, 0.1 + 0.2]
floats = st.floats(allow_subnormal=True) | st.sampled_from(ODD)
pairs = st.tuples(floats, floats).map(np.array)
triples = st.tuples(floats, floats, floats).map(np.array)
times = st.integers(0, 2**62)
texts = st.text(st.characters(codec="utf-8"), max_size=20)
world_samples = st.one_of(
    st.builds(JointState, times, pairs, pairs, pairs),
    st.builds(GasSample, times, st.integers(0, 1), floats),
    st.builds(Truth, times, pairs, triples, triples, floats),
    st.builds(Event, times, texts.filter(lambda kind: kind != "progress"), texts),
)


def create(path: Path, **metadata: str) -> Any:
    return RunLog.create(path, sensor="ec", joints=("a", "b"), metadata=metadata, attachments={"config.yaml": b"dof: 2\n"})


def bits(record: Any) -> list[Any]:
    """A record as something that is equal only if every bit of it is."""
    values = (getattr(record, name) for name in type(record).__slots__)
    return [type(record), *(np.asarray(v, dtype=float).tobytes() if isinstance(v, float | np.ndarray) else v for v in values)]


def gas(path: Path, count: int = 30) -> Path:
    """Ten gas samples a second."""
    with create(path) as log:
        for i in range(1, count + 1):
            log.write(GasSample(i * SECOND_NS // 10, i % 2, math.sin(i)))
    return path


@settings(max_examples=30, deadline=None)
@given(st.lists(world_samples, max_size=12))
def test_samples_come_back_bit_for_bit_in_written_order(samples: list[WorldSample]) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.mcap"
        with create(path) as log:
            for sample in samples:
                log.write(sample)
            assert [bits(s) for s in log.samples()] == [bits(s) for s in samples]
        assert [bits(s) for s in read_samples(path)] == [bits(s) for s in samples]


@settings(max_examples=30, deadline=None)
@given(
    st.integers(1, 5).flatmap(
        lambda n: st.tuples(st.lists(floats, min_size=n, max_size=n), st.lists(floats, min_size=n * n, max_size=n * n))
    )
)
def test_beliefs_and_innovations_come_back_bit_for_bit(numbers: tuple[list[float], list[float]]) -> None:
    mean, flat = numbers
    n = len(mean)
    square = np.array(flat).reshape(n, n)
    upper = np.triu(np.ones((n, n), dtype=bool))
    belief = Belief(3, mean, np.where(upper, square, square.T))
    innovation = Innovation(4, mean, square, gated=True)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.mcap"
        with create(path) as log, np.errstate(all="ignore"):
            log.estimate(belief, tuple("abcde"[:n]), ("m",) * n)
            log.innovation(innovation)
        assert [bits(b) for b in read_beliefs(path)] == [bits(belief)]
        assert [bits(i) for i in read_innovations(path)] == [bits(innovation)]


def test_beliefs_are_thinned_to_a_rate_anew_in_every_stage(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    belief = [Belief(i * SECOND_NS // 10, [float(i)], [[1.0]]) for i in range(20)]
    with create(path) as log:
        with log.stage("navigate", lambda: 0):
            for each in belief[:12]:
                log.estimate(each, ("a",), ("m",), 0.5)
            log.estimate(belief[12], ("a",), ("m",))  # a map
        with log.stage("again", lambda: 0):
            for each in belief[13:]:
                log.estimate(each, ("a",), ("m",), 0.5)
    assert [int(b.mean[0]) for b in read_beliefs(path)] == [0, 5, 10, 12, 13, 18]


def test_estimates_of_other_filters_come_back_bit_for_bit_and_are_no_odometry(tmp_path: Path) -> None:
    """They are written at the end, of times long past, and mix with nothing that the run's own filter wrote."""
    path, cov = tmp_path / "run.mcap", np.array([[2.0, 0.1, 0.2], [0.1, 1.0, 1 / 3], [0.2, 1 / 3, 3.0]])
    made = [FilterEstimate(t_ns, "cold", [0.1, t_ns, -0.0], cov, [math.pi, 0.0, 5e-324], 2 * cov) for t_ns in (7, SECOND_NS)]
    with create(path) as log:
        log.write(GasSample(2 * SECOND_NS, 0, 1.0))
        for one in made:
            log.filter_estimate(one)
    assert [bits(one) for one in read_filter_estimates(path)] == [bits(one) for one in made]
    assert [bits(one) for one in read_run(path).others] == [bits(one) for one in made]
    assert (list(read_odometry(path)), list(read_beliefs(path)), read_end(path)) == ([], [], 2 * SECOND_NS)


def test_a_window_is_open_below_and_closed_above(tmp_path: Path) -> None:
    path = gas(tmp_path / "run.mcap")
    assert [s.t_ns for s in read_samples(path, SECOND_NS, 2 * SECOND_NS)] == [i * SECOND_NS // 10 for i in range(11, 21)]
    assert len(list(read_samples(path, until_ns=0))) == 0
    assert read_end(path) == 3 * SECOND_NS


def test_memory_stays_while_reading(tmp_path: Path) -> None:
    peaks = []
    for count in (2_000, 8_000):
        path = gas(tmp_path / f"{count}.mcap", count)
        for s in itertools.islice(read_samples(path), 1):
            assert s.t_ns == SECOND_NS // 10
        tracemalloc.start()
        assert sum(1 for _ in read_samples(path)) == count
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.5 * peaks[0] + 200_000  # the index, read once to check it, is all that grows


def test_attachments(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    with create(path) as log:
        log.attach("calibration.yaml", b"first")
        log.attach("calibration.yaml", b"second")
        log.attach("empty", b"")
    assert read_attachment(path, "config.yaml") == b"dof: 2\n"
    assert read_attachment(path, "calibration.yaml") == b"second"
    assert read_attachment(path, "empty") == b""
    with pytest.raises(BadInput) as refused:
        read_attachment(path, "report.pdf")
    assert str(refused.value) == f"{path} has no attachment 'report.pdf'. It has: calibration.yaml, config.yaml, empty."


def refusal(path: Path) -> str:
    with pytest.raises(BadInput) as refused:
        list(read_samples(path))
    with pytest.raises(BadInput):
        read_attachment(path, "config.yaml")
    return str(refused.value)


def test_no_file(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    assert refusal(path) == f"{path} was given as a log, but there is no such file. {GIVE}"
    assert refusal(tmp_path) == f"{tmp_path} was given as a log, but it is a folder. {GIVE}"


@pytest.mark.parametrize("content", [b"", b"t_s,ppm\n0,5\n"])
def test_no_mcap(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "run.csv"
    path.write_bytes(content)
    assert refusal(path) == f"{path} was given as a log, but it is not an MCAP file. {GIVE}"


def foreign(path: Path, **metadata: str) -> Path:
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        if metadata:
            writer.add_metadata("oio.run", metadata)
        schema = writer.register_schema("text", "jsonschema", b"{}")
        writer.add_message(writer.register_channel("/chat", "json", schema), 5, b"{}", 5)
        writer.finish()  # type: ignore[no-untyped-call]
    return path


def test_an_mcap_of_somebody_else(tmp_path: Path) -> None:
    path = foreign(tmp_path / "drive.mcap")
    assert refusal(path) == f"{path} is an MCAP file, but without the record 'oio.run': it was not written by OIO. {GIVE}"


def test_a_log_of_another_version(tmp_path: Path) -> None:
    path = foreign(tmp_path / "run.mcap", schema_version="2", oio="3.1.0")
    assert (
        refusal(path)
        == f"{path} has schema_version 2, but this OIO reads 1 only. Read it with the OIO that wrote it: pip install oio==3.1.0"
    )


def test_a_log_without_its_end(tmp_path: Path) -> None:
    path = gas(tmp_path / "run.mcap", 100)
    whole = path.read_bytes()
    path.write_bytes(whole[: whole.rindex(b"/gas/ec/sample") // 2])
    until_s = refusal(path).split("readable until ")[1].split(" s.")[0]
    assert 1 <= float(until_s) < 10
    assert refusal(path) == (
        f"{path} has no end: the run was killed, is still going on, or the copy broke off. It is readable until "
        f"{until_s} s. Only finished logs are read. Type `python -m oio.recover {path}` to make one of it."
    )
    path.write_bytes(whole[:-1])
    assert "It is readable until 10.000 s." in refusal(path)


def test_a_log_that_is_being_written_is_not_finished(tmp_path: Path) -> None:
    with create(tmp_path / "run.mcap") as log:
        log.write(GasSample(SECOND_NS, 0, 1.0))
        assert len(list(log.samples())) == 1
        assert "is still going on" in refusal(tmp_path / "run.mcap.part")


def test_one_flipped_bit_anywhere_is_refused(tmp_path: Path) -> None:
    path = gas(tmp_path / "run.mcap")
    whole = path.read_bytes()
    for at in range(0, len(whole), 1 + len(whole) // 400):
        path.write_bytes(whole[:at] + bytes([whole[at] ^ (1 << at % 8)]) + whole[at + 1 :])
        refusal(path)


CHUNK, DATA_END = 6, 15
CHUNK_HEAD = 9 + 3 * 8 + 4 + 4 + len("zstd") + 8  # up to the zstd frame: lengths, times, checksum, name of the compression


def heads(whole: bytes) -> Iterator[tuple[int, int]]:
    """Where each record's head begins and how long it is: of a chunk all but its data, of others opcode and length, at last all DataEnd."""
    at, opcode = 8, 0
    while opcode != DATA_END:  # all that follows is under one checksum
        opcode, length = struct.unpack_from("<BQ", whole, at)
        yield at, {CHUNK: CHUNK_HEAD, DATA_END: 9 + length}.get(opcode, 9)
        at += 9 + length


def test_one_flipped_bit_in_any_head_is_refused(tmp_path: Path) -> None:
    """A chunk that says it is longer than the file takes all that follows for its own, and what it holds is sound."""
    path = gas(tmp_path / "run.mcap")
    whole = path.read_bytes()
    assert sum(whole[at] == CHUNK for at, _ in heads(whole)) == 3
    for at in (at for begin, length in heads(whole) for at in range(begin, begin + length)):
        for bit in range(8):
            path.write_bytes(whole[:at] + bytes([whole[at] ^ (1 << bit)]) + whole[at + 1 :])
            refusal(path)


def test_damage_says_where_and_what_to_type(tmp_path: Path) -> None:
    path = gas(tmp_path / "run.mcap", 100)
    whole = bytearray(path.read_bytes())
    whole[whole.rindex(b"(\xb5/\xfd") + 40] ^= 1  # in the last zstd frame
    path.write_bytes(whole)
    text = refusal(path)
    assert text.startswith(f"{path} is damaged (after 9.000 s: ")
    assert text.endswith(
        "), and only a log that is bit for bit as it was written is read. "
        f"Copy it again, or type `python -m oio.recover {path}` to keep what is sound."
    )


def test_metadata_needs_a_whole_log_too(tmp_path: Path) -> None:
    path = gas(tmp_path / "run.mcap")
    assert read_metadata(path)["dof"] == "2"
    path.write_bytes(path.read_bytes()[:-20])
    with pytest.raises(BadInput, match="has no end"):
        read_metadata(path)
