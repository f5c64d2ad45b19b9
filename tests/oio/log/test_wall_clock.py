"""The log of a bench begins at the time of day, and is read as if it began at 0: equal to the bit to one that does."""

import dataclasses
from datetime import datetime, timedelta
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from oio.core.errors import BadInput
from oio.core.records import SECOND_NS, Belief, Event, GasReading, GasSample, Innovation, JointState
from oio.log import ArmFrames, RunLog, Setup, read_beliefs, read_end, read_entries, read_metadata, read_samples, recover, salvage
from oio.log.part_file import METADATA, open_writer
from oio.log.schemas import SCHEMA_VERSION
from oio.log.wall_clock import start_ns

STARTED = "2026-03-01T12:00:00.250000+01:00"
AT_NS = 1_772_362_800_250_000_000


def write(path: Path, metadata: dict[str, str]) -> Path:
    """A log of three seconds with all that has a stamp, read back between."""
    with RunLog.create(path, sensor="ec", joints=("a",), metadata=metadata, attachments={"config.yaml": b"x"}) as log:
        log.setup(Setup(np.eye(3)[:2], [], np.array([np.zeros(3), np.ones(3)]), np.ones(3)))
        with log.stage("warm_up", lambda: 0):
            log.write(Event(0, "present", "none"))
            for i in range(1, 31):
                t_ns = i * SECOND_NS // 10 + i  # not whole microseconds
                log.write(JointState(t_ns, [0.1 * i], [0.0], [0.0]))
                log.arm(ArmFrames(t_ns, np.ones((2, 3)), np.tile([0.0, 0.0, 0.0, 1.0], (2, 1))))
                log.write(GasSample(t_ns, 0, float(i)))
                log.reading(GasReading(t_ns, 0, float(i), 0.1))
                if i == 20:
                    assert [s.t_ns for s in log.samples(SECOND_NS) if isinstance(s, GasSample)] == [
                        j * SECOND_NS // 10 + j for j in range(10, 21)
                    ]
        log.estimate(Belief(t_ns, [1.0], [[1.0]]), ("x",), ("m",))
        log.innovation(Innovation(t_ns, [2.0], [[4.0]], gated=False))
        log.odometry(t_ns, np.ones(3), np.eye(3))
        log.spheres(t_ns, np.zeros((1, 3)), np.ones(1), [(np.ones(3), np.eye(3))], "one")
    return path


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("clock")
    return SimpleNamespace(plain=write(folder / "plain.mcap", {}), bench=write(folder / "bench.mcap", {"started": STARTED}))


def same(a, b):
    return type(a) is type(b) and all(
        np.array_equal(getattr(a, f.name), getattr(b, f.name)) for f in dataclasses.fields(a) if f.name != "hypotheses"
    )


def test_readers_find_the_same_records_bit_for_bit(logs):
    for read in (read_samples, read_beliefs, read_entries, lambda path: read_samples(path, SECOND_NS, 2 * SECOND_NS)):
        pairs = list(zip(read(logs.plain), read(logs.bench), strict=True))
        assert pairs and all(same(a, b) for a, b in pairs)
    assert read_end(logs.plain) == read_end(logs.bench) == 3 * SECOND_NS + 30
    assert read_metadata(logs.bench)["started"] == STARTED and "started" not in read_metadata(logs.plain)


def messages(path):
    with path.open("rb") as file:
        found = make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages(log_time_order=False)
        return [(entry.message.log_time, entry.decoded_message) for entry in found]


def stamps(message):
    parts = (message, *getattr(message, "entities", ()), *getattr(message, "transforms", ()))
    found = [getattr(part, name) for part in parts for name in ("stamp", "timestamp") if hasattr(part, name)]
    return [at.seconds * SECOND_NS + at.nanos for at in found]


def test_every_stamp_in_the_file_is_the_time_of_day(logs):
    plain, bench = messages(logs.plain), messages(logs.bench)
    for (t_ns, one), (at_ns, other) in zip(plain, bench, strict=True):
        assert at_ns - t_ns == AT_NS
        assert stamps(one) and [b - a for a, b in zip(stamps(one), stamps(other), strict=True)] == [AT_NS] * len(stamps(one))
    assert datetime.fromtimestamp(bench[0][0] / 1e9, tz=datetime.fromisoformat(STARTED).tzinfo).hour == 12


def test_a_log_that_was_cut_off_is_recovered_with_its_clock(logs, tmp_path):
    part = tmp_path / "run.mcap.part"
    part.write_bytes(logs.bench.read_bytes()[:-200])
    found = salvage(part, tmp_path / "run.mcap")
    assert found.until_ns == 3 * SECOND_NS + 30
    assert all(same(a, b) for a, b in zip(read_samples(logs.plain), read_samples(tmp_path / "run.mcap"), strict=True))
    assert recover(logs.bench, tmp_path / "again.mcap") == found.messages


def test_a_start_without_its_zone_is_no_time():
    assert start_ns({}) == 0 and start_ns({"started": STARTED}) == AT_NS
    later = datetime.fromisoformat(STARTED) + timedelta(microseconds=1)
    assert start_ns({"started": later.isoformat()}) == AT_NS + 1000
    for wrong in ("2026-03-01T12:00:00", "yesterday"):
        with pytest.raises(ValueError, match=r"offset|Invalid"):
            start_ns({"started": wrong})


def test_a_log_with_a_start_that_is_no_time_is_refused(tmp_path):
    with (tmp_path / "run.mcap").open("wb") as file:
        writer = open_writer(file)
        writer.add_metadata(METADATA, {"schema_version": SCHEMA_VERSION, "started": "yesterday"})
        writer.finish()
    for read in (read_end, read_samples, read_metadata):
        with pytest.raises(BadInput, match="damaged"):
            read(tmp_path / "run.mcap")
