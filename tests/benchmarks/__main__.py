"""`make bench`: what a step costs beside the least that it could cost, both in one process, so that the machine cancels.

Each line is a ratio to a reference: plain NumPy, filterpy, the bare MCAP writer, bare MuJoCo, one worker. Growth is fitted as a power.
The table goes to the terminal, and with a file name to that file as Markdown: python tests/benchmarks docs/benchmarks.md
"""

import os
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
from mcap.writer import CompressionType, Writer

import oio.sweep  # noqa: F401  - sets the threads of BLAS before numpy is used
from hardware.air import puffs
from hardware.simulation.live_room import LiveRoom
from hardware.simulation.plant import Plant
from oio.bench.filter_workload import workload
from oio.bench.filters import timed
from oio.bench.trial import composed_trial, run_trial
from oio.cli.build import build
from oio.cli.compose import compose
from oio.cli.execute import execute
from oio.cli.shared_stages import SharedStages
from oio.core.records import JointState
from oio.inference.belief_map import BeliefMap
from oio.inference.forward_model import Problem
from oio.log import RunLog
from oio.log.encode import world_sample

ROOT = Path(__file__).resolve().parents[2]
WORDS = ("sensor=ec", "dof=5")
AS_TRIALS = ("stage.evaluate.paper_assembly=false", "stage.evaluate.cold_maps=last")  # scored as the trials of benchmarks are
Line = tuple[str, str, str, str]  # what, measured, reference, ratio
PARTS = (("physics", Plant, "_step"), ("gas", LiveRoom, "step"), ("gas", LiveRoom, "ppm"), ("maps", BeliefMap, "locate"))
GPU = """
There is no extra for a GPU. It would simulate many worlds at once (MJX or MuJoCo Warp), but physics and gas have the shares of a trial that
stand above: with both free of charge it would be shorter by no more than that. The rest are fits of maps with few parameters and few
readings, each of its own length, which do not fill a GPU. More cores and more machines help in full.
"""


def fastest(work: Callable[[], object], repeats: int = 7) -> float:
    """Seconds of the fastest of several runs."""
    taken = []
    for _ in range(repeats):
        began = time.perf_counter()
        work()
        taken.append(time.perf_counter() - began)
    return min(taken)


def plume() -> Line:
    """Concentration at a point of a thousand puffs, against the same sum in NumPy."""
    rng = np.random.default_rng(0)
    table = puffs.table(1000)
    table[:3], table[puffs.AMOUNT] = rng.normal(0.0, 0.2, (3, 1000)), 1.0
    puffs.grow(table, 1000, 1e-4, 1e-3)
    p = np.array([0.05, 0.0, 0.02])

    def numpy_sum() -> float:
        d2 = ((table[:3] - p[:, None].astype(np.float32)) ** 2).sum(axis=0)
        return float((table[puffs.PEAK] * np.exp(-table[puffs.SHARP] * d2)).sum())

    assert abs(puffs.density(table, 1000, p) / numpy_sum() - 1.0) < 1e-4
    ours = fastest(lambda: [puffs.density(table, 1000, p) for _ in range(200)]) / 200
    theirs = fastest(lambda: [numpy_sum() for _ in range(200)]) / 200
    return "gas at the nose, 1000 puffs", f"{1e6 * ours:.1f} us", "NumPy", f"{ours / theirs:.2f}"


def filter_step() -> Line:
    """A prediction and an update of the default filter, against filterpy's with the model evaluated as in use."""
    _, built = composed_trial(WORDS)
    row = timed({"ekf": built.stages["navigate"].ekf}, workload(built, 400), 5)[0]
    return "filter, a step", f"{row.step_us:.0f} us", "filterpy with the model", f"{row.ratio_with_model:.2f}"


def log_message() -> Line:
    """A joint state to the log, against its bytes to the bare MCAP writer."""
    states = [JointState(20_000_000 * i, np.full(5, 1e-3 * i), np.full(5, 0.05), np.zeros(5)) for i in range(2000)]
    names = ("a", "b", "c", "d", "e")
    with tempfile.TemporaryDirectory() as folder:
        count = iter(range(100))

        def ours() -> None:
            path = Path(folder) / f"{next(count)}.mcap"
            with RunLog.create(path, sensor="ec", joints=names, metadata={}, attachments={}) as log:
                for state in states:
                    log.write(state)

        data = [message.SerializeToString() for state in states for message in world_sample(state, "ec", names).values()]

        def bare() -> None:
            with (Path(folder) / f"{next(count)}.mcap").open("wb") as file:
                writer = Writer(file, compression=CompressionType.ZSTD)
                writer.start()
                schema = writer.register_schema("s", "protobuf", b"")
                channel = writer.register_channel("/c", "protobuf", schema)
                for i, message in enumerate(data):
                    writer.add_message(channel, i, message, i, i)
                writer.finish()

        took, least = fastest(ours, 5), fastest(bare, 5)
    return "log, a joint state", f"{1e6 * took / len(states):.0f} us", "MCAP writer, bytes ready", f"{took / least:.2f}"


def tick() -> Line:
    """A control tick of the simulated bench with gas, sensor, encoders and guard, against its five steps of MuJoCo."""
    _, built = composed_trial(WORDS)
    with built.backend.open() as world:
        world.present("beacon")
        ticks = sum(isinstance(sample, JointState) for sample in world.samples(5.0))
        took = fastest(lambda: list(world.samples(5.0))) / ticks
        model, data = world._plant._model, world._plant._data
        least = fastest(lambda: mujoco.mj_step(model, data, 5 * ticks)) / ticks
    return "simulation, a tick of 20 ms", f"{1e6 * took:.0f} us", "MuJoCo alone", f"{took / least:.2f}"


def forward_growth() -> Line:
    """The forward model over 300 to 3000 readings: exponent of its cost."""
    cost = {}
    kept: list[Problem] = []
    original = Problem.predict

    def spy(self: Problem, *given: object) -> object:
        kept.append(self)
        return original(self, *given)

    Problem.predict = spy  # type: ignore[method-assign]
    try:
        run_trial((*WORDS, "stage.navigate.max_moves=30"), 0)
    finally:
        Problem.predict = original  # type: ignore[method-assign]
    longest = max(kept, key=lambda problem: len(problem.sniffs.ppm))
    sn = longest.sniffs
    for readings in (300, 1000, 3000):
        n = -(-readings // len(sn.ppm))
        span = sn.t_s[-1] - sn.t_s[0] + 1.0
        many = replace(
            sn, t_s=np.concatenate([sn.t_s + i * span for i in range(n)]), q=np.concatenate([sn.q] * n),
            at=np.concatenate([sn.at + i * len(sn.t_s) for i in range(n)]), element=np.concatenate([sn.element] * n),
            reading_t_s=np.concatenate([sn.reading_t_s + i * span for i in range(n)]),
            ppm=np.concatenate([sn.ppm] * n), sigma_ppm=np.concatenate([sn.sigma_ppm] * n), censored=np.concatenate([sn.censored] * n),
        )  # fmt: skip
        problem = replace(longest, sniffs=many)
        cost[n * len(sn.ppm)] = fastest(lambda problem=problem: problem.predict(problem.mean), 9)
    x, y = np.log(list(cost)), np.log(list(cost.values()))
    power = float(np.polyfit(x, y, 1)[0])
    return (
        "map, one pass over the readings",
        f"{1e6 * cost[max(cost)] / max(cost):.2f} us a reading",
        "power of their number",
        f"{power:.2f}",
    )


def parts() -> list[Line]:
    """What parts of a trial take, as shares of it: what another processor for one of them could save at most."""
    spent: Counter[str] = Counter()

    def timed_as(part: str, kind: type, name: str) -> None:
        plain = getattr(kind, name)

        def method(*given: object, **named: object) -> object:
            began = time.perf_counter()
            try:
                return plain(*given, **named)
            finally:
                spent[part] += time.perf_counter() - began

        undo.append((kind, name, plain))
        setattr(kind, name, method)

    undo: list[tuple[type, str, object]] = []
    run_trial(WORDS, 0)
    for part, kind, name in (
        ("physics", Plant, "_step"),
        ("gas", LiveRoom, "step"),
        ("gas", LiveRoom, "ppm"),
        ("maps", BeliefMap, "locate"),
    ):
        timed_as(part, kind, name)
    try:
        began = time.perf_counter()
        for seed in range(3):
            run_trial(WORDS, seed)
        whole = time.perf_counter() - began
    finally:
        for kind, name, plain in undo:
            setattr(kind, name, plain)
    return [(f"{part}, of a trial", f"{took / 3:.2f} s", "the trial", f"{took / whole:.2f}") for part, took in spent.items()]


def runs() -> list[Line]:
    """A run with its log against the trial in memory, and the second of two gates of a filter over one truth against that run alone."""
    with tempfile.TemporaryDirectory() as folder:

        def run(name: str, shared: SharedStages | None, *words: str) -> float:
            composed = compose([*WORDS, "seed=0", *AS_TRIALS, *words], ())
            built = build(composed.cfg, composed.choices, [])
            began = time.perf_counter()
            execute(built, Path(folder) / name, quiet=True, shared=shared)
            return time.perf_counter() - began

        run("warm", None)
        logged, trial = min(run("logged", None), run("again", None)), fastest(lambda: run_trial(WORDS, 0), 2)
        shared = SharedStages()
        run("first", shared)
        second, alone = run("second", shared, "ekf.gate_nis=12"), run("alone", None, "ekf.gate_nis=12")
    return [
        ("run with its log", f"{logged:.1f} s", "trial in memory", f"{logged / trial:.2f}"),
        ("second filter over one truth", f"{second:.1f} s", "the same run alone", f"{second / alone:.2f}"),
    ]


def start_up() -> list[Line]:
    """Help and the imports of a run, against Python with NumPy."""

    def run(*line: str) -> float:
        return fastest(lambda: subprocess.run([sys.executable, *line], cwd=ROOT, check=True, capture_output=True), 3)

    least = run("-c", "import numpy")
    return [
        (what, f"{took:.2f} s", "Python with NumPy", f"{took / least:.1f}")
        for what, took in (("--help", run("-m", "oio.run", "--help")), ("imports of a run", run("-c", "import oio.cli.run")))
    ]


def parent_work() -> Line:
    """What a sweep's parent does for each of 1000 jobs that cost nothing: plan, hand out, receive, keep."""
    code = """
import json, sys
from oio.cli import run
from oio.cli.run_folder import write_status
from oio.sweep import launch
SUMMARY = {"backend": "mujoco", "sensor": "ec", "dof": 5, "air": "still", "seed": 0, "wall_s": 1}
SUMMARY |= {"calibrated": None, "cold": None, "calibration": None}
class Free:
    def run(self, works):
        for work in works:
            work.out.mkdir(parents=True)
            (work.out / "run.mcap").write_bytes(b"x" * 100000)
            (work.out / "summary.json").write_text(json.dumps(SUMMARY))
            write_status(work.out, "done")
            yield work, "done", None
launch.engine_of = lambda launcher: Free()
folder, seeds = sys.argv[1:]
sys.argv = ["oio.run", "-m", "sensor=ec,ndir", f"seed=range(0,{seeds})", "hydra.sweep.dir=" + folder]
run.main()
"""
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "OIO_CACHE": f"{folder}/cache"}

        def sweep(name: str, seeds: int) -> float:
            began = time.perf_counter()
            line = [sys.executable, "-c", code, f"{folder}/{name}", str(seeds)]
            subprocess.run(line, cwd=ROOT, check=True, capture_output=True, env=environment)
            return time.perf_counter() - began

        each = (sweep("many", 500) - sweep("few", 5)) / (2 * 495)
    return "sweep, work of the parent per job", f"{1e3 * each:.1f} ms", "promise 10 ms", f"{each / 0.010:.2f}"


def workers() -> Line:
    """Eight short runs by two workers, against one worker."""
    with tempfile.TemporaryDirectory() as folder:

        def sweep(jobs: int) -> float:
            words = (*WORDS[:1], "dof=3", "seed=range(0,8)", "cache=off", "hydra/launcher=joblib", f"hydra.launcher.n_jobs={jobs}")
            line = [sys.executable, "-m", "oio.run", "-m", *words, f"hydra.sweep.dir={folder}/{jobs}"]
            began = time.perf_counter()
            subprocess.run(line, cwd=ROOT, check=True, capture_output=True)
            return time.perf_counter() - began

        one, two = sweep(1), sweep(2)
    return "sweep of 8 runs, two workers", f"{two:.0f} s", "one worker", f"{two / one:.2f}"


def main() -> None:
    """Print the table, or write it to the file that is given."""
    lines = [plume(), filter_step(), log_message(), tick(), forward_growth(), *parts(), *runs(), *start_up(), parent_work(), workers()]
    table = "| what | measured | reference | ratio |\n|---|---|---|---|\n" + "".join(f"| {' | '.join(line)} |\n" for line in lines)
    if len(sys.argv) > 1:
        page = Path(sys.argv[1])
        head = "# What a step costs\n\n"
        head += "`make bench` makes this table, here on two cores; a ratio compares two things, one after the other.\n\n"
        page.write_text(head + table + GPU, encoding="utf-8")
    sys.stdout.write(table)


if __name__ == "__main__":
    main()
