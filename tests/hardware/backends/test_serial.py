"""`backend=serial` against the emulators, as a person would run it: two processes and ptys between them."""

import json
import math
import os
import re
import signal
import subprocess
import sys
import time
from collections import Counter
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from oio.cli.exit_codes import VERDICT_FAILED
from oio.cli.recover import main as recover
from oio.core.records import GasSample, JointState
from oio.kinematics.homing import Homing
from oio.log import read_metadata, read_samples
from tests.hardware.conftest import Stalls

pytestmark = pytest.mark.long

ROOT = Path(__file__).resolve().parents[3]
ENV = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
NOSES = {"ndir": "scd30", "pa": "scd41", "ec": "line", "mox_mq": "line", "mox_mics": "line"}
SAYS = {"ndir": "SCD30, firmware ", "pa": "SEK-SensorBridge, SCD41 f8969f073bbe", "ec": "OIO-NOSE, 1, "}  # the noses of themselves
CALM = 0.05  # of the time that a host may lose before what it times is none of ours
STALL_S, TRIES = 0.2, 3  # one so long may stop an arm, at twice the speed of life
SHORT = "stage=[warm_up,baseline,calibrate_bouts]"


@pytest.mark.parametrize("sensor", [pytest.param("ndir", marks=pytest.mark.slow), pytest.param("pa", marks=pytest.mark.slow), "ec"])
def test_a_nose_alone_warms_up_and_every_sample_is_accounted_for(emulators, sensor):
    bench = emulators(f"nose={NOSES[sensor]}", f"sensor={sensor}", "arm=none", "valve=none", "speed=3")
    run = bench.run("stage=[warm_up,baseline]")
    assert run.code == 0, run.said
    samples, account = run.samples(), run.account()
    assert json.loads(read_metadata(run.log)["devices"])["backend.nose"].startswith(SAYS[sensor])
    gas, joints, waiting, _ = run.taken()
    assert (gas, joints) == run.logged() and gas > 20 and waiting < 5 and run.all_accounted()
    assert "corrupt 0" in account.split(";")[0] or "corrupt" not in account.split(";")[0]
    elements = Counter(s.element for s in samples if isinstance(s, GasSample))
    assert len(elements) == (2 if sensor == "ec" else 1) and min(elements.values()) > 0.3 * gas / len(elements)


@pytest.mark.parametrize("arm", ["feetech", pytest.param("dynamixel", marks=pytest.mark.slow)])
def test_an_arm_climbs_toward_the_beacon_and_its_log_replays_to_the_bit(emulators, arm, tmp_path):
    run = emulators("nose=scd30", f"arm={arm}", "speed=3").run(SHORT)
    assert run.code == 0, run.said
    samples = run.samples()
    assert run.all_accounted()
    began = datetime.fromisoformat(read_metadata(run.log)["started"])
    assert timedelta(0) < datetime.now(UTC) - began < timedelta(hours=1) and samples[0].t_ns < 60e9
    q = np.array([s.q for s in samples if isinstance(s, JointState)])
    assert np.sum(np.ptp(q, axis=0) > 0.02) >= 3  # joints that have moved
    words = [
        sys.executable,
        "-m",
        "oio.run",
        "report=false",
        "backend=replay",
        f"backend.log={run.log}",
        f"hydra.run.dir={tmp_path / 'again'}",
    ]
    again = subprocess.run(words, cwd=ROOT, env=ENV, capture_output=True, text=True, check=False)
    assert again.returncode == 0, again.stderr
    first, second = (json.loads((out / "summary.json").read_text(encoding="utf-8")) for out in (run.out, tmp_path / "again"))
    for document in (first, second):
        del document["wall_s"], document["backend"]
    assert first == second


def test_an_emulated_bus_is_read_a_hundred_times_a_second(emulators):
    """On a machine that lets it; measured, not asked for, on one that stalls."""
    bench = emulators("nose=scd30", "arm=feetech")
    with Stalls() as stalls:
        run = bench.run("stage=[warm_up]")
    hz, jitter = (float(x) for x in re.search(r"joints ([\d.]+) Hz, jitter ([\d.]+) ms", run.account()).groups())
    assert math.isfinite(jitter) and hz > (100.0 if stalls.lost < CALM else 30.0), (run.account(), str(stalls))


@pytest.mark.parametrize("signal_", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.slow)])
def test_a_stop_that_was_asked_for_stops_the_arm_and_leaves_a_readable_log(emulators, signal_):
    bench = emulators("nose=scd30", "arm=feetech", "speed=4")
    process, out = bench.start()
    end = time.monotonic() + 60
    while not (out / "run.mcap.part").exists() and time.monotonic() < end:
        time.sleep(0.1)
    time.sleep(2.0)
    process.send_signal(signal_)
    _, errors = process.communicate(timeout=20)
    assert process.returncode == 130 and "Traceback" not in errors and "oio.recover" in errors, errors
    recover([str(out / "run.mcap.part"), str(out / "recovered.mcap")])
    assert sum(isinstance(s, GasSample) for s in read_samples(out / "recovered.mcap")) > 5
    assert bench.run("stage=[warm_up]").code == 0  # its ports are free again


@pytest.mark.parametrize("arm", [[], ["backend.arm.driver=feetech", "backend.arm.port=/dev/null"]])
def test_a_port_that_is_not_there_is_refused_in_one_paragraph(tmp_path, arm):
    words = [
        "backend=serial",
        "sensor=ndir",
        "profile=datasheet",
        f"arm.homing={tmp_path}/homing.json",
        "backend.nose.driver=scd30",
        f"backend.nose.port={tmp_path}/nothing",
        f"hydra.run.dir={tmp_path}/out",
    ]
    words += ["backend.valve.driver=none", *arm]
    Homing.nominal(5, 2048).write(tmp_path / "homing.json")
    run = subprocess.run(
        [sys.executable, "-m", "oio.run", *words, "report=false"], cwd=ROOT, env=ENV, capture_output=True, text=True, check=False
    )
    assert run.returncode == 2 and "no such port" in run.stderr and "hardware.ports" in run.stderr and "Traceback" not in run.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "words, told",
    [
        (["backend.nose.driver=scd40"], "backend.nose.driver=scd40 was given, but it can be scd30, scd41, line"),
        (["backend.nose.driver=line"], "sensor=ndir goes with scd30 or scd41"),
        (["backend.nose.driver=scd30", "backend.arm.driver=feetech"], r"has no port.*backend\.arm\.port="),
        (["backend.nose.driver=scd30", "backend.valve.driver=tap"], "it can be ask, line, none"),
        (["backend.nose.driver=scd30", "backend.speed=4"], "is real, and so is its time"),
        (["backend.nose.driver=scd30"], r"gives a value every 2 s\. Type profile=datasheet"),
        (["backend.nose.driver=scd41", "sensor=pa"], r"gives a value every 5 s\. Type profile=datasheet"),
        (
            ["backend.nose.driver=scd30", "profile=datasheet", "backend.arm.driver=feetech", "backend.arm.port=/dev/null"],
            r"without arm\.homing.*hardware\.home port=/dev/null",
        ),
    ],
)
def test_settings_that_make_no_sense_are_refused(words, told, tmp_path):
    out = f"hydra.run.dir={tmp_path}/out"
    command = [sys.executable, "-m", "oio.run", "backend=serial", "backend.nose.port=/dev/null", "sensor=ndir", *words, out]
    run = subprocess.run(command, cwd=ROOT, env=ENV, capture_output=True, text=True, check=False)
    assert run.returncode == 2 and re.search(told, run.stderr), run.stderr


def whole_run(emulators, *words):
    """A run with all stages, and how the host stalled meanwhile. An arm that was stopped on a host that stalled is tried again;
    nothing else is forgiven, and every try is told."""
    for k in range(TRIES):
        bench = emulators(*words)
        with Stalls() as stalls:
            run = bench.run(within_s=400)
        bench.close()  # or it would go on beside the next
        if run.code == 0:
            assert run.all_accounted(), (run.account(), run.missing())
            return run, stalls
        assert run.code == 1 and "the arm was stopped" in run.said and stalls.longest_s > STALL_S, (run.said, str(stalls))
        print(f"try {k + 1} of {TRIES} does not count: {run.said.strip().splitlines()[-1]} {stalls}")
    pytest.skip(f"{stalls}, in each of {TRIES} runs: on such a machine nothing can be led in real time. Run it again where it is quiet.")


@pytest.mark.slow
@pytest.mark.alone
@pytest.mark.parametrize("sensor", NOSES)
def test_over_the_wire_a_source_is_found_as_well_as_in_simulation(emulators, sensor, tmp_path):
    """Median of three seeds, at most twice that of `backend=mujoco`; a sniff takes less than 2 ms from its last byte to the belief, where
    the machine lets it."""
    wire_m, simulated_m = [], []
    for seed in range(3):
        run, stalls = whole_run(emulators, f"nose={NOSES[sensor]}", f"sensor={sensor}", f"seed={seed}", "arm=feetech", "speed=2")
        wire_m.append(run.summary()["calibrated"]["source_error_m"])
        delay_ms = float(re.search(r"last byte to belief .*\(([\d.]+) ms median.* of all", run.account()).group(1))
        assert delay_ms < (2.0 if stalls.lost < CALM else 10.0), (run.account(), str(stalls))
        print(f"{sensor} seed {seed}: {1e3 * wire_m[-1]:.1f} mm, last byte to belief {delay_ms} ms; {stalls}")
        out = tmp_path / f"simulated{seed}"
        words = [f"sensor={sensor}", f"seed={seed}", "arm.encoder_drift_deg_s2=0", f"hydra.run.dir={out}"]
        done = subprocess.run(
            [sys.executable, "-m", "oio.run", *words, "report=false"], cwd=ROOT, env=ENV, capture_output=True, check=False
        )
        assert done.returncode in (0, VERDICT_FAILED), done.stderr
        simulated_m.append(json.loads((out / "summary.json").read_text(encoding="utf-8"))["calibrated"]["source_error_m"])
    assert np.median(wire_m) <= 2.0 * np.median(simulated_m), (wire_m, simulated_m)


@pytest.mark.slow
@pytest.mark.alone
def test_the_first_run_after_an_install_compiles_while_the_arm_stands(emulators, tmp_path):
    """Else the guard would hold the arm: a host that compiles is silent for 20 s."""
    run = emulators("nose=scd30", "arm=feetech", "speed=2").run(within_s=400, NUMBA_CACHE_DIR=str(tmp_path / "empty"))
    assert run.code == 0, run.said


def test_ports_say_what_they_are_and_what_to_paste(emulators):
    bench = emulators("nose=scd30", "arm=feetech")
    ports = [str(bench.folder / "ports" / name) for name in ("nose", "arm", "valve")]
    run = subprocess.run([sys.executable, "-m", "hardware.ports", *ports], cwd=ROOT, env=ENV, capture_output=True, text=True, check=False)
    assert run.returncode == 0 and "SCD30, firmware" in run.stdout and "5 STS3215" in run.stdout, run.stderr
    assert f"backend.nose.driver=scd30 backend.nose.port={ports[0]}" in run.stdout
    assert f"backend.arm.driver=feetech backend.arm.port={ports[1]}" in run.stdout
    assert "OIO-NOSE, 1, 10" in run.stdout and f"backend.valve.driver=line backend.valve.port={ports[2]}" in run.stdout


@pytest.mark.parametrize("word", ["port=/dev/ttyUSB0", "/dev/no"])
def test_ports_refuse_what_is_no_path(word):
    command = [sys.executable, "-m", "hardware.ports", word]
    run = subprocess.run(command, cwd=ROOT, env=ENV, capture_output=True, text=True, check=False)
    assert run.returncode == 2 and run.stderr.startswith(f"oio: {word} was given, but there is no such port"), run.stderr
    assert run.stderr.count("\n") == 1


@pytest.mark.parametrize("arm", ["feetech", "dynamixel"])
def test_homing_asks_for_both_ends_by_name_and_refuses_a_joint_that_was_not_turned(emulators, arm):
    bench = emulators("nose=scd30", f"arm={arm}")
    file = bench.folder / "homing.json"
    words = [f"port={bench.folder / 'ports' / 'arm'}", f"driver={arm}", f"out={file}", "repeats=1"]
    command = [sys.executable, "-m", "hardware.home", *words]
    person = subprocess.Popen(command, cwd=ROOT, env=ENV, text=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    told, errors = person.communicate("\n" * 3, timeout=60)
    assert person.returncode == 1 and "Hold the arm" in told and told.count("turn it by hand") == 2, errors
    assert "LOW end (-110 degrees; from home the nose goes to the arm's left)" in told and "HIGH end (110 degrees" in told
    assert "was turned by 0 degrees, but its ends in the MJCF are" in errors and "Traceback" not in errors and not file.exists()


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ([], "no port was given"),
        (["prot=x"], "knows driver, port"),
        (["port=/dev/no", "sign=1,1,1,1,1"], "sign=1,1,1,1,1 was given, but `python -m hardware.home` knows driver, port"),
        (["port=/dev/no"], "no such port"),
        (["port=/x", "arm=no"], "arm can be franka, gantry"),
    ],
)
def test_homing_refuses_what_makes_no_sense(words, told):
    run = subprocess.run([sys.executable, "-m", "hardware.home", *words], cwd=ROOT, env=ENV, capture_output=True, text=True, check=False)
    assert run.returncode == 2 and told in run.stderr and "Traceback" not in run.stderr
