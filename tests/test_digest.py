"""The estimates of whole runs are equal to the bit to those on record: a change that should not change behaviour is held to it here.

A change that is meant to change estimates records them anew, and says so in the changelog: `python tests/test_digest.py`. Numbers are
made by code that every x86-64 processor with AVX2 runs alike (see PORTABLE); other versions of the libraries may round otherwise, and
then the tests are skipped and say so.
"""

import hashlib
import json
import os
import platform
import subprocess
import sys
import tempfile
from importlib import metadata
from pathlib import Path

import numpy as np
import pytest

from oio.core.records import GasSample, JointState
from oio.log import read_beliefs, read_innovations, read_odometry, read_readings, read_samples

pytestmark = pytest.mark.long

ROOT = Path(__file__).resolve().parents[1]
RECORD = ROOT / "tests" / "digests.json"
BENCH_LOG = ROOT / "tests" / "logs" / "emulated_bench.mcap"  # what a run over emulated wires (line nose, Feetech arm) sensed
PORTABLE = {
    "OPENBLAS_CORETYPE": "Haswell",
    "NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR",
    "NUMBA_CPU_NAME": "generic",
    "NUMBA_CPU_FEATURES": "",
}
LIBRARIES = ("numpy", "scipy", "numba", "mujoco", "filterpy")

EVERY_BELIEF = "stage.navigate.belief_every_s=0"  # to the log
SHORT = (
    "dof=3", "seed=3", "stage.navigate.max_moves=15", "stage.map_beliefs.repeats=2", "stage.map_beliefs.budget_s=0",
    "stage.calibrate_bouts.moves_per_rung=2",
)  # fmt: skip
WHOLE = {
    f"{sensor} dof={dof} {air}": (f"sensor={sensor}", f"dof={dof}", f"air={air}", "seed=11")
    for sensor in ("ec", "ndir", "mox_mics")
    for dof in (3, 5)
    for air in ("still", "draft")
}
CHANGED = ("wind_turns", "second_source", "fading", "wall")
WAYS_IN = {
    "replay": ("backend=replay", "backend.log={ndir dof=3 draft}", "ekf=iterated"),
    "recording": (
        "backend=recording", "recording=orebro3dsen", "arm=gantry", "dof=3", "sensor=mox_mq", "beacon.position=[2.70,0.50,0.90]",
        "stage.navigate.max_moves=20",
    ),
    "emulated bench": (
        "backend=replay", f"backend.log={BENCH_LOG}", "sensor=ec", *SHORT, "arm.encoder_drift_deg_s2=0",
    ),
}  # fmt: skip
VARIANTS = {
    **{f"search={name}": ("sensor=ndir", *SHORT, f"search={name}") for name in ("infotaxis", "gradient", "cast_surge", "bandit", "random")},
    **{f"ekf={name}": ("sensor=pa", *SHORT, f"ekf={name}") for name in ("fixed_lag", "ukf", "ckf", "gaussian_sum", "filterpy", "paper")},
    "evidence": ("sensor=mox_mq", "air=ventilated", *SHORT, "range_law.form=evidence"),
    "two joints": ("sensor=ec", *SHORT, "dof=2", "assembly=paper"),
    "the parts' own timing": ("sensor=ndir", *SHORT, "profile=datasheet"),
    **{f"world={name}": ("sensor=ndir", "dof=5", "seed=103", "stage.navigate.max_moves=30", f"world={name}") for name in CHANGED},
}
CASES = {**WHOLE, **WAYS_IN, **VARIANTS}
QUICK = {"ndir dof=3 draft", "two joints", "ec dof=5 still", "replay", "recording", "emulated bench"}
SLOW = [name for name in CASES if name not in QUICK]


def run(name, folder):
    """Run one case, and before it the one whose log it replays; returns its folder."""
    words = CASES[name]
    out = folder / name.replace(" ", "_").replace("=", "_").replace("'", "")
    if (out / "summary.json").exists():
        return out
    told = [word.partition("{")[2].rstrip("}") for word in words]
    logs = {f"{{{other}}}": str(run(other, folder) / "run.mcap") for other in told if other}
    for hole, log in logs.items():
        words = tuple(word.replace(hole, log) for word in words)
    command = [sys.executable, "-m", "oio.run", *words, EVERY_BELIEF, "report=false", f"hydra.run.dir={out}"]
    done = subprocess.run(command, cwd=ROOT, env={**os.environ, **PORTABLE}, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode in (0, 3), done.stderr  # with so few moves the verdict may be FAIL
    return out


def digest(out):
    """SHA-256 of all numbers that a run sensed, believed and scored, in order; and a few of them, for a person."""
    log, sha, summary = out / "run.mcap", hashlib.sha256(), json.loads((out / "summary.json").read_text(encoding="utf-8"))
    for sample in read_samples(log):
        if isinstance(sample, JointState):
            _add(sha, sample.t_ns, sample.q, sample.dq, sample.ddq)
        elif isinstance(sample, GasSample):
            _add(sha, sample.t_ns, sample.element, sample.raw)
    for reading in read_readings(log):
        _add(sha, reading.t_ns, reading.element, reading.ppm, reading.sigma_ppm)
    for belief in read_beliefs(log):
        _add(sha, belief.t_ns, belief.mean, belief.cov)
    for nose in read_odometry(log):
        _add(sha, *_numbers(nose))
    for innovation in read_innovations(log):
        _add(sha, innovation.t_ns, innovation.residual, innovation.cov, innovation.gated)
    scored = {key: value for key, value in summary.items() if key in ("cold", "cold_open", "calibrated", "calibrated_paper_assembly")}
    scored |= {key: value for key, value in summary.items() if "bound" in key or key in ("calibration", "dead_reckoning", "simulated_s")}
    _add(sha, *_numbers(scored))
    calibrated = summary["calibrated"]
    return {"sha256": sha.hexdigest(), "moves": calibrated["moves"], "believed_m": calibrated["believed_m"]}


def _add(sha, *values):
    for value in values:
        sha.update(np.asarray(value, dtype=np.float64).tobytes())


def _numbers(value):
    """All numbers of nested records, dicts and lists, in order of keys; None counts as NaN, words as nothing."""
    if isinstance(value, str):
        return []
    if isinstance(value, dict):
        return [number for key in sorted(value) for number in _numbers(value[key])]
    if isinstance(value, list | tuple):
        return [number for inner in value for number in _numbers(inner)]
    return [np.nan if value is None else value]


def versions():
    return {"machine": platform.machine(), **{name: metadata.version(name) for name in LIBRARIES}}


def recorded():
    return json.loads(RECORD.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("digests")


def check(name, folder):
    on_record = recorded()
    if on_record["versions"] != versions():
        pytest.skip(f"recorded with {on_record['versions']}, here are {versions()}: numbers may be rounded otherwise")
    if name == "recording" and not (Path(os.environ.get("OIO_DATA", "data")) / "orebro3dsen").is_dir():
        pytest.skip("no recordings here: OIO_DATA names no folder that has them")
    assert digest(run(name, folder)) == on_record["runs"][name]


@pytest.mark.parametrize("name", sorted(QUICK))
def test_estimates_are_equal_to_the_bit(name, folder):
    check(name, folder)


@pytest.mark.slow
@pytest.mark.parametrize("name", SLOW)
def test_estimates_of_all_kinds_of_run_are_equal_to_the_bit(name, folder):
    check(name, folder)


def test_every_case_is_on_record():
    assert set(recorded()["runs"]) == set(CASES)


def test_another_seed_has_another_digest(folder):
    """So that equal digests mean something."""
    assert len({run_["sha256"] for run_ in recorded()["runs"].values()}) == len(CASES)


if __name__ == "__main__":
    chosen = sys.argv[1:] or list(CASES)
    runs = recorded()["runs"] if RECORD.exists() else {}
    with tempfile.TemporaryDirectory() as made:
        for case in chosen:
            runs[case] = digest(run(case, Path(made)))
            print(case, runs[case], flush=True)
    ordered = {case: runs[case] for case in CASES if case in runs}
    RECORD.write_text(json.dumps({"versions": versions(), "runs": ordered}, indent=1) + "\n", encoding="utf-8")
