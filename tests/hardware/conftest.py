"""Emulated benches and runs against them; the firmware of the nose, compiled, and the simulated board that it runs on."""

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, TextIO

import pytest

from oio.cli.recover import main as recover
from oio.core.records import Event, GasSample, JointState, WorldSample
from oio.log import read_samples

ROOT = Path(__file__).resolve().parents[2]
ENV = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}

SLACK = 2  # samples
NAP_S = 0.005

FIRMWARE = Path(__file__).resolve().parents[2] / "hardware" / "firmware" / "nose"
BOARD = Path(__file__).parent / "firmware"
PACKAGES = "gcc make gcc-avr avr-libc avrdude libsimavr-dev libelf-dev"


def skip_without(*tools: str) -> None:
    """Say what is missing, and what brings it."""
    missing = [tool for tool in tools if shutil.which(tool) is None and not Path(tool).is_file()]
    if missing:
        pytest.skip(f"no {', '.join(missing)}: apt-get install {PACKAGES}")


@pytest.fixture(scope="session")
def built_firmware(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """The ELF, made with these flags besides; a warning is an error."""

    skip_without("make", "avr-gcc", "avr-objcopy", "avr-size", "avr-nm")

    def build(flags: str) -> Path:
        folder = tmp_path_factory.mktemp("firmware")
        subprocess.run(["make", "-C", FIRMWARE, f"BUILD={folder}", f"EXTRA=-Werror {flags}"], check=True, capture_output=True, text=True)
        return folder / "nose.elf"

    return build


@pytest.fixture(scope="session")
def host(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The tool that runs an ELF on a simulated microcontroller; see firmware/host.c."""
    skip_without("gcc", "/usr/include/simavr/sim_avr.h", "/usr/include/libelf.h")
    out = tmp_path_factory.mktemp("host") / "host"
    flags = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Werror", "-I/usr/include/simavr"]
    subprocess.run(["gcc", *flags, "-o", out, *sorted(BOARD.glob("*.c")), "-lsimavr", "-lelf", "-lutil"], check=True)
    return out


@pytest.fixture(scope="session")
def elf(built_firmware: Callable[[str], Path]) -> Path:
    """The firmware as it is flashed."""
    return built_firmware("")


@dataclass
class Run:
    """What came of one run."""

    code: int
    said: str
    out: Path

    @property
    def log(self) -> Path:
        """Finished or not."""
        whole = self.out / "run.mcap"
        return whole if whole.exists() else self.out / "run.mcap.part"

    def samples(self) -> list[WorldSample]:
        """Of the log, in order of time."""
        path = self.log
        if path.suffix == ".part":
            copy = self.out / "recovered.mcap"
            if not copy.exists():
                recover([str(path), str(copy)])
            path = copy
        samples = list(read_samples(path))
        assert all(a.t_ns <= b.t_ns for a, b in pairwise(samples))
        return samples

    def account(self) -> str:
        """The last one of the links."""
        return [s.text for s in self.samples() if isinstance(s, Event) and s.kind == "link"][-1]

    def taken(self) -> tuple[int, ...]:
        """Gas samples and joint states that the bench gave away, and those that waited, as it says itself."""
        found = re.search(r"taken (\d+) gas (\d+) joints, waiting (\d+) and (\d+)", self.account())
        assert found
        return tuple(int(x) for x in found.groups())

    def logged(self) -> tuple[int, int]:
        """Gas samples and joint states up to the last account, for what comes later is not in it."""
        samples = self.samples()
        last = max(i for i, s in enumerate(samples) if isinstance(s, Event) and s.kind == "link")
        kinds = Counter(type(s) for s in samples[:last])
        return kinds[GasSample], kinds[JointState]

    def all_accounted(self) -> bool:
        """Whether every sample that a driver made is in the log, or counted as what else became of it.

        A run that ended before its first account has nothing to compare.
        """
        if not any(isinstance(s, Event) and s.kind == "link" for s in self.samples()):
            return True
        return self.taken()[:2] == self.logged() and all(-SLACK <= missing <= SLACK for missing in self.missing())

    def missing(self) -> tuple[int, ...]:
        """Gas samples and joint states that the drivers made and nobody knows of; what is on its way while the account is made may show."""
        account, (gas, joints, waiting, standing) = self.account(), self.taken()
        way = re.search(r"way home (\d+) and (\d+); late \d+, overflown (\d+)", account)
        assert way
        made = sum(int(n) for n in re.findall(r"(?:samples|saturated) (\d+)", account))
        rounds = re.search(r"rounds (\d+)", account)
        overflown = int(way[3])
        gone = (0,) if rounds is None else (int(rounds[1]) - joints - standing - int(way[2]) - overflown,)
        return (made - gas - waiting - int(way[1]) - overflown * (rounds is None), *gone)

    def summary(self) -> Any:
        """Its numbers."""
        return json.loads((self.out / "summary.json").read_text(encoding="utf-8"))


class Stalls(threading.Thread):
    """How long the host kept this process waiting while the block ran, though it asked for 5 ms: virtual machines lose seconds."""

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self.longest_s, self._lost_s, self._began_s, self._leave = 0.0, 0.0, time.monotonic(), threading.Event()

    def __enter__(self) -> "Stalls":
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._leave.set()
        self.join()

    def run(self) -> None:
        """Until the block ends."""
        while not self._leave.is_set():
            before_s = time.monotonic()
            time.sleep(NAP_S)
            late_s = time.monotonic() - before_s - NAP_S
            self.longest_s = max(self.longest_s, late_s)
            self._lost_s += late_s if late_s > NAP_S else 0.0

    @property
    def lost(self) -> float:
        """Share of the time."""
        return self._lost_s / (time.monotonic() - self._began_s)

    def __str__(self) -> str:
        return f"the host stalled: {1e3 * self.longest_s:.0f} ms at the longest, {100 * self.lost:.1f} % of the time in all"


class Emulators:
    """A process of `python -m hardware.emulate`, and runs against it as a person would start them."""

    def __init__(self, folder: Path, *words: str) -> None:
        self.folder = folder
        folder.mkdir()
        command = [sys.executable, "-m", "hardware.emulate", f"out={folder / 'ports'}", *words]
        self._errors: TextIO = (folder / "errors").open("w")
        self._process = subprocess.Popen(command, cwd=ROOT, env=ENV, stdout=subprocess.PIPE, stderr=self._errors, text=True)
        assert self._process.stdout
        told = self._process.stdout.readline()
        assert "oio.run" in told, (folder / "errors").read_text()
        self._command = [sys.executable, *shlex.split(told)[1:], "report=false"]

    def start(self, *words: str, stdin: int = subprocess.DEVNULL, **env: str) -> "tuple[subprocess.Popen[str], Path]":
        """A run that goes on, and its folder."""
        out = self.folder / f"run{len(list(self.folder.glob('run*')))}"
        process = subprocess.Popen(
            [*self._command, *words, f"hydra.run.dir={out}"], cwd=ROOT, env={**ENV, **env}, text=True,
            stdin=stdin, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        )  # fmt: skip
        return process, out

    def run(self, *words: str, within_s: float = 240, **env: str) -> Run:
        """A whole run."""
        process, out = self.start(*words, **env)
        try:
            said, errors = process.communicate(timeout=within_s)
        finally:
            process.kill()
        assert "Traceback" not in errors, errors
        return Run(process.returncode, said + errors, out)

    def close(self) -> None:
        """As Ctrl-C does. Once is enough."""
        if self._errors.closed:
            return
        self._process.terminate()
        self._process.wait(20)
        assert self._process.stdout
        self._process.stdout.close()
        self._errors.close()
        assert "Traceback" not in (self.folder / "errors").read_text()


@pytest.fixture
def emulators(tmp_path: Path) -> Iterator[Callable[..., Emulators]]:
    """emulators(*words) starts a process that ends with the test."""
    made: list[Emulators] = []

    def start(*words: str) -> Emulators:
        made.append(Emulators(tmp_path / f"bench{len(made)}", *words))
        return made[-1]

    yield start
    for bench in made:
        bench.close()
