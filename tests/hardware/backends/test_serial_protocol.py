"""A protocol against the emulators, unattended and with a person who takes time; its log reproduces to the bit."""

import json
import os
import pty
import subprocess
import sys
import time
from pathlib import Path

import pytest

from oio.core.records import Event, GasSample
from oio.log import read_metadata, read_samples
from oio.procedure.written_answers import protocol_events

pytestmark = pytest.mark.long

ROOT = Path(__file__).resolve().parents[3]
ANSWERS = "operator: Ada\nsensor_serial: '0012'\ngas_closed: done\nroom_degc: 21.5\nundisturbed: yes\n"
SECONDS = 1_000_000_000


def reproduced(run):
    done = subprocess.run([sys.executable, "-m", "oio.reproduce", str(run)], cwd=ROOT, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout + done.stderr


def test_a_protocol_runs_unattended_and_its_log_reproduces(emulators, tmp_path):
    (tmp_path / "answers.yaml").write_text(ANSWERS)
    bench = emulators("nose=scd30", "arm=feetech", "speed=3")
    words = ("protocol=emulated", f"protocol.answers={tmp_path / 'answers.yaml'}", "stage=[warm_up,baseline,calibrate_bouts]")
    run = bench.run(*words)
    assert run.code == 0, run.said
    summary, about = json.loads((run.out / "summary.json").read_text()), read_metadata(run.log)
    assert summary["protocol"]["answers"]["sensor_serial"] == "0012"
    devices = json.loads(about["devices"])
    assert devices["backend.nose"].startswith("SCD30, firmware") and devices["backend.arm"].startswith("servos 1 STS3215")
    assert json.loads(about["reproducible"]) == summary["reproducible"]
    assert not any("said nothing" in reason for reason in summary["reproducible"]["reasons"])
    code, said = reproduced(run.out)
    assert code == 0 and "replayed: " in said and "readings: 0" not in said and "differs" not in said, said


@pytest.mark.slow
def test_a_person_takes_time_while_the_bench_goes_on_and_the_log_reproduces(emulators):
    bench = emulators("nose=scd30", "arm=none", "valve=none", "speed=3")
    own, terminal = pty.openpty()
    process, out = bench.start("protocol=emulated", "stage=[warm_up,baseline]", stdin=terminal)
    os.close(terminal)
    while process.poll() is None and not (out / "run.mcap.part").exists():  # a busy host takes its time to start
        time.sleep(0.1)
    for typed in ("Ada\n", "0012\n", "\n", "21\n", "y\n"):
        time.sleep(2.0)  # of the host: 6 s of the bench
        os.write(own, typed.encode())
    said, errors = process.communicate(timeout=120)
    os.close(own)
    assert process.returncode == 0, said + errors
    steps = [event for event in protocol_events(out / "run.mcap") if event["step"] == "gas_closed"]
    assert steps[1]["t_ns"] - steps[0]["t_ns"] > 2 * SECONDS
    asked = [s for s in read_samples(out / "run.mcap") if steps[0]["t_ns"] < s.t_ns < steps[1]["t_ns"]]
    assert any(isinstance(s, GasSample) for s in asked)
    assert not any(isinstance(s, Event) and s.kind == "span" for s in asked)  # one span, however long it took
    code, said = reproduced(out)
    assert code == 0 and "readings: 0" not in said, said


@pytest.mark.slow
def test_a_whole_search_with_a_protocol_reproduces(emulators, tmp_path):
    (tmp_path / "answers.yaml").write_text(ANSWERS)
    bench = emulators("nose=line", "sensor=ec", "arm=feetech", "speed=2")
    run = bench.run("protocol=emulated", f"protocol.answers={tmp_path / 'answers.yaml'}", "stage.navigate.max_moves=10")
    assert run.code in (0, 3), run.said  # ten moves are few: the verdict may be FAIL
    code, said = reproduced(run.out)
    assert code == 0 and "beliefs: 0" not in said, said
