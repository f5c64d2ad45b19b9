"""Firmware in the loop: MuJoCo pose -> plume -> sensor law -> millivolts -> ADC -> compiled firmware -> pty -> driver -> pipeline."""

import contextlib
import json
import os
import re
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hardware.backends.mujoco_sim import MujocoSim
from hardware.emulators.emulated_port import EmulatedPort, EventQueue
from hardware.emulators.feetech import Feetech
from hardware.emulators.loop import Loop
from hardware.emulators.pty import PseudoTerminal
from hardware.emulators.realtime_plant import RealtimePlant
from oio.core.records import Event, GasSample
from oio.log import read_samples

pytestmark = pytest.mark.long

ROOT = Path(__file__).resolve().parents[3]
ENV = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
SUPPLY_MV, FULL = 5000, 1023  # of the ADC
SENSOR = ("sensor=mox_mq", "sensor.adc_bits=10")  # a divider between the same 5 V, as it is soldered
PATIENT = (
    "safety.heartbeat_timeout_s=20",
    "backend.timeouts.receive_s=10",
)  # simavr does the work of a board, and may have to wait for the processor
SPOILT = r"(lost|corrupt) [1-9]|skipped [1-9]\d\d"  # a port that is opened within a sentence skips what is left of it
NO_DRIFT = "arm.encoder_drift_deg_s2=0"  # the paper's may be 16 degrees in three minutes: a joint pushes against its end, and is stopped
NOT_STUCK = "backend.nose.stuck_after=1000"  # ten bits of clean air are often the same count for minutes


class Board:
    """A simulated microcontroller with the firmware; `path` is its serial line."""

    def __init__(self, host: Path, elf: Path, speed: float) -> None:
        self._process = subprocess.Popen([host, elf, str(speed)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1)
        assert self._process.stdout
        self.path, self.valve = self._process.stdout.readline().split()[1], (0, 0)
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self._process.stdout
        for line in self._process.stdout:
            if line.startswith("valve"):
                beacon, source = line.split()[1:3]
                self.valve = int(beacon), int(source)

    def volts(self, counts: list[float]) -> None:
        """On its ADC, in the middle of these counts."""
        assert self._process.stdin
        self._process.stdin.write(" ".join(str(round((c + 0.5) * SUPPLY_MV / FULL)) for c in counts) + "\n")

    def close(self) -> None:
        """Pull its plug."""
        assert self._process.stdin and self._process.stdout
        self._process.stdin.close()
        try:
            assert self._process.wait(60) == 0
        finally:
            self._process.kill()
            self._reader.join()
            self._process.stdout.close()


class Wired(RealtimePlant):
    """At each tick the nose's ADC gets what the sensor's electronics give, and the relays open what they open."""

    OPEN = {(0, 0): "none", (1, 0): "beacon", (0, 1): "source"}  # noqa: RUF012

    def wire(self, nose: Board, valve: Board | None) -> None:
        """To these boards."""
        self._nose, self._valve, self._open = nose, valve, "none"
        self.given: list[list[float]] = [[], []]  # counts of each element, as they came from the plant

    def tick(self) -> None:
        """Then time goes on."""
        super().tick()
        counts = [self.raw(element) for element in range(2)]
        for given, count in zip(self.given, counts, strict=True):
            given.append(count)
        self._nose.volts(counts)
        wanted = self.OPEN[self._valve.valve] if self._valve else "none"
        if wanted != self._open:
            self._open = wanted
            self.present(wanted)


class Room:
    """A running bench with an arm or without; `words` connect a run to it."""

    def __init__(self, realtime: Wired, words: list[str]) -> None:
        self.realtime, self.words = realtime, words

    def run(self, out: Path, *words: str, within_s: float = 300) -> "subprocess.CompletedProcess[str]":
        """`python -m oio.run` against it."""
        command = [
            sys.executable,
            "-m",
            "oio.run",
            "report=false",
            "backend=serial",
            *SENSOR,
            NOT_STUCK,
            *self.words,
            *words,
            f"hydra.run.dir={out}",
        ]
        return subprocess.run(command, cwd=ROOT, env=ENV, capture_output=True, text=True, timeout=within_s, check=False)


@pytest.fixture
def rooms(host: Path, elf: Path, tmp_path: Path, composed: Any, built: Any) -> Callable[..., contextlib.AbstractContextManager[Room]]:
    """rooms(speed=2.0, arm=False)."""

    @contextlib.contextmanager
    def made(speed: float, arm: bool) -> Iterator[Room]:
        sim: MujocoSim = built("backend", *SENSOR, NO_DRIFT)
        with contextlib.ExitStack() as stack:
            plant = stack.enter_context(sim.plant())
            realtime = Wired(plant, sim.arm, speed)
            nose, *others = [Board(host, elf, speed) for _ in range(1 + arm)]
            for board in (nose, *others):
                stack.callback(board.close)
            realtime.wire(nose, others[0] if arm else None)
            words = [f"backend.speed={speed:g}", "backend.nose.driver=line", f"backend.nose.port={nose.path}", "backend.valve.driver=none"]
            served, agenda = {}, EventQueue()
            if arm:
                port = PseudoTerminal(tmp_path / "arm")
                port.plug()
                stack.callback(port.unplug)
                served["arm"] = EmulatedPort(Feetech(realtime, set()), port, set(), agenda, speed, np.random.default_rng(0))
                words[-1] = "backend.valve.driver=line"
                words += [f"backend.valve.port={others[0].path}", "backend.arm.driver=feetech", f"backend.arm.port={port.link}"]
                words += [f"source.position={plant.places['source'].tolist()}"]  # for scoring alone
            with Loop(realtime, served, agenda, ()).running():
                yield Room(realtime, words)

    return made


def accounted(out: Path) -> tuple[list[GasSample], str]:
    """The gas in the log, and the last account."""
    samples = list(read_samples(out / "run.mcap"))
    account = [s.text for s in samples if isinstance(s, Event) and s.kind == "link"][-1]
    return [s for s in samples if isinstance(s, GasSample)], account


def test_what_the_plume_does_to_the_sensor_reaches_the_log_through_the_firmware(rooms: Any, tmp_path: Path) -> None:
    with rooms(speed=1.0, arm=False) as room:  # the host has one period, then, to select the other element
        run = room.run(tmp_path / "out", "stage=[warm_up,baseline]")
    assert run.returncode in (0, 3), run.stderr  # few moves: the verdict may be FAIL
    gas, account = accounted(tmp_path / "out")
    assert len(gas) > 20 and not re.search(SPOILT, account), account
    elements = [s.element for s in gas]
    assert abs(elements.count(0) - elements.count(1)) <= 2  # they take turns
    for element in (0, 1):
        assert {s.raw for s in gas if s.element == element} <= set(room.realtime.given[element])  # to the count
    assert {s.raw for s in gas if s.element == 0} != {s.raw for s in gas if s.element == 1}


def test_another_converter_than_that_of_the_board_is_refused(rooms: Any, tmp_path: Path) -> None:
    with rooms(speed=2.0, arm=False) as room:
        run = room.run(tmp_path / "out", "sensor.adc_bits=16")
    assert run.returncode == 2 and "converts to 10 bits, but sensor.adc_bits is 16" in re.sub(r"\s+", " ", run.stderr)


@pytest.mark.slow
@pytest.mark.alone
def test_a_whole_run_through_the_firmware_finds_the_source(rooms: Any, tmp_path: Path) -> None:
    with rooms(speed=0.5, arm=True) as room:  # two boards at real time would take most of a small machine
        run = room.run(tmp_path / "out", *PATIENT, NO_DRIFT, within_s=1200)
    assert run.returncode in (0, 3), run.stderr  # few moves: the verdict may be FAIL
    summary = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    gas, account = accounted(tmp_path / "out")
    assert not re.search(SPOILT, account.split(";")[0]), account
    assert np.median(np.diff([1e-9 * s.t_ns for s in gas])) == pytest.approx(0.5, abs=0.01)  # sensor.sample_s
    assert summary["calibrated"]["source_error_m"] < 0.05, (run.stdout, account)
