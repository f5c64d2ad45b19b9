"""What a crash leaves behind can be read to within two seconds, and the rescuer says what it kept."""

import os
import random
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from oio.cli.recover import main
from oio.core.errors import BadInput
from oio.core.records import SECOND_NS, GasSample, JointState
from oio.log import RunLog, read_attachment, read_metadata, read_samples, recover

GIVE = "Give the log of an OIO run, e.g. outputs/2026-01-31/12-00-00/run.mcap."

WRITER = """
import sys, time
from pathlib import Path
from oio.log import RunLog
from oio.core.records import GasSample, JointState
with RunLog.create(Path(sys.argv[1]), sensor="ec", joints=("a",), metadata={"seed": "1"}, attachments={"config.yaml": b"dof: 1"}) as log:
    for i in range(1, 10**9):
        t_ns = i * 20_000_000
        log.write(JointState(t_ns, [i * 0.1], [0.0], [0.0]))
        if i % 5 == 0:
            log.write(GasSample(t_ns, 0, i * 0.01))
        print(t_ns, flush=True)
        if i % 10 == 0:
            time.sleep(0.001)
"""


def create(path: Path) -> Any:
    return RunLog.create(path, sensor="ec", joints=("a",), metadata={}, attachments={"config.yaml": b"dof: 1"})


def finished(path: Path, for_s: int = 10) -> Path:
    with create(path) as log:
        for i in range(1, 10 * for_s + 1):
            log.write(GasSample(i * SECOND_NS // 10, 0, i * 0.1))
    return path


def killed_after(path: Path, lines: int) -> int:
    """Let a writer print so many times, kill it, and return the last time it had printed."""
    with subprocess.Popen([sys.executable, "-c", WRITER, str(path)], stdout=subprocess.PIPE) as writer:
        assert writer.stdout is not None
        printed = [int(writer.stdout.readline()) for _ in range(lines)]
        os.kill(writer.pid, signal.SIGKILL)
        rest = writer.stdout.read().split(b"\n")[:-1]  # what it still managed to say
    return int(rest[-1]) if rest else printed[-1]


def test_a_killed_run_loses_less_than_two_seconds(tmp_path: Path) -> None:
    for attempt in range(2):
        path = tmp_path / f"{attempt}.mcap"
        last_ns = killed_after(path, random.Random(attempt).randint(150, 1500))
        part, out = path.with_name(path.name + ".part"), path
        assert recover(part, out) > 0
        samples = list(read_samples(out))
        expected = range(20_000_000, last_ns - 2 * SECOND_NS + 1, 20_000_000)
        joints = {s.t_ns: s for s in samples if isinstance(s, JointState)}
        gas = {s.t_ns: s for s in samples if isinstance(s, GasSample)}
        assert all(joints[t].q[0] == t // 20_000_000 * 0.1 for t in expected)
        assert all(gas[t].raw == t // 20_000_000 * 0.01 for t in expected if t % 100_000_000 == 0)
        assert read_metadata(out)["seed"] == "1"
        assert read_attachment(out, "config.yaml") == b"dof: 1"


def test_a_whole_log_is_kept_whole(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = finished(tmp_path / "run.mcap")
    assert main([str(path)]) == 0
    out = tmp_path / "run.recovered.mcap"
    assert capsys.readouterr().out == f"{out}: 100 messages kept, until 10.000 s; nothing is missing.\n"
    assert [(s.t_ns, s.raw) for s in read_samples(out)] == [(s.t_ns, s.raw) for s in read_samples(path)]  # type: ignore[union-attr]
    assert read_metadata(out) == read_metadata(path)


def test_a_lost_index_is_no_loss(tmp_path: Path) -> None:
    path = finished(tmp_path / "run.mcap")
    path.write_bytes(path.read_bytes()[:-1])
    assert main([str(path)]) == 0


@pytest.mark.parametrize("part", [0.3, 0.6, 0.9])
def test_a_cut_log_is_kept_until_the_cut(tmp_path: Path, part: float, capsys: pytest.CaptureFixture[str]) -> None:
    path = finished(tmp_path / "run.mcap", 100)
    whole = path.read_bytes()
    end = whole.rindex(b"(\xb5/\xfd")  # of the last zstd frame: all before it is samples
    cut = tmp_path / "cut.mcap.part"
    cut.write_bytes(whole[: int(part * end)])
    assert main([str(cut)]) == 3
    kept = list(read_samples(tmp_path / "cut.mcap"))
    assert 100 * part - 5 < len(kept) / 10 <= 100 * part + 5
    said = (
        f"{tmp_path / 'cut.mcap'}: {len(kept)} messages kept, until {len(kept) / 10:.3f} s; the end or some damaged chunks are missing.\n"
    )
    assert capsys.readouterr().out == said


def test_a_damaged_chunk_is_passed_over(tmp_path: Path) -> None:
    path = finished(tmp_path / "run.mcap")
    damaged = bytearray(path.read_bytes())
    frames = [i for i in range(len(damaged)) if damaged[i : i + 4] == b"(\xb5/\xfd"]
    damaged[frames[4] + 30] ^= 1
    path.write_bytes(damaged)
    assert main([str(path), str(tmp_path / "out.mcap")]) == 3
    assert len(list(read_samples(tmp_path / "out.mcap"))) == 90
    damaged[frames[0] + 30] ^= 1  # the first declares the channels, but so does the index
    path.write_bytes(damaged)
    assert main([str(path), str(tmp_path / "out2.mcap")]) == 3
    assert len(list(read_samples(tmp_path / "out2.mcap"))) == 80
    path.write_bytes(damaged[:-1])  # neither is left: no message can be told from another
    assert main([str(path), str(tmp_path / "out3.mcap")]) == 1
    assert [p.name for p in tmp_path.glob("out3*")] == []


def test_nothing_to_keep(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(RuntimeError), create(tmp_path / "run.mcap"):
        raise RuntimeError
    part = tmp_path / "run.mcap.part"
    assert main([str(part)]) == 1
    assert capsys.readouterr().out == f"{part}: nothing could be kept, no message in it is complete.\n"
    assert not (tmp_path / "run.mcap").exists()


def test_bad_input(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "run.mcap"
    assert main([str(path)]) == 2
    assert capsys.readouterr().err == f"{path} was given as a log, but there is no such file. {GIVE}\n"
    path.write_bytes(b"no")
    assert main([str(path)]) == 2
    assert capsys.readouterr().err == f"{path} was given as a log, but it is not an MCAP file. {GIVE}\n"
    whole, out = finished(tmp_path / "whole.mcap"), tmp_path / "out.mcap"
    out.write_bytes(b"precious")
    with pytest.raises(BadInput) as refused:
        recover(whole, out)
    assert str(refused.value) == (
        f"{out} is there already, and a log is never overwritten. Type `python -m oio.recover {whole} OUT` with another OUT."
    )
    assert out.read_bytes() == b"precious"


def test_help(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["--help"])
    assert ended.value.code == 0
    assert "3 the end or some damaged chunks are lost" in capsys.readouterr().out.replace("\n", " ").replace("  ", " ")
