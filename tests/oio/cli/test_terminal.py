"""What is printed keeps to the terminal: its width, and NO_COLOR (no-color.org)."""

import contextlib
import os
import subprocess
import sys
from pathlib import Path

import pytest
from rich.cells import cell_len

from oio.bench.drift_table import show as show_drift
from oio.bench.filters import Row as FilterRow
from oio.bench.filters import show as show_filters
from oio.cli import terminal
from oio.cli.console import show_summary
from oio.cli.table_layout import print_table
from oio.sweep.job_table import show_sweep
from oio.sweep.manifest import Job, Outcome

ROOT = Path(__file__).resolve().parents[3]
CRITERIA = [
    {"name": name, "about": "search", "word": word, "value": 0.5, "found": found, "allowed": "0.5 to 1.7", "action": action}
    for name, word, found, action in (
        (
            "nis",
            "WARN",
            "mean NIS is 0.49, and 1 is what is expected of a consistent filter",
            "R is too large, so readings count for too little.",
        ),
        ("beacon_error", "PASS", "the beacon was found 26 mm off (RMS)", ""),
    )
]
SCORES = {
    "source_error_m": 0.0123, "sd_m": 0.01, "nose_error_m": 0.1746, "nees_source": 12.0, "inside_95": True, "nis_mean": 1.0,
    "moves": 109, "time_s": 161.0, "found": True,
}  # fmt: skip
DOCUMENT = {
    "sensor": "ec", "profile": "paper", "dof": 5, "air": "still", "seed": 7, "cold": SCORES, "cold_open": SCORES, "calibrated": SCORES,
    "calibrated_paper_assembly": SCORES, "dead_reckoning": {"nose_error_m": 0.02}, "bound_m": None, "calibration": None,
    "verdict": "WARN", "reasons": [], "wall_s": 4.0,
}  # fmt: skip
FULL = {**DOCUMENT, "calibration": {"time_s": 80.0, "moves": 40, "u_a_ppm": 0.4, "u_b_m": 0.006, "error_ppm": 1.5}}


def summary():
    show_summary(DOCUMENT, "out")


def verdict():
    show_summary({**FULL, "criteria": CRITERIA, "verdicts": {"calibration": "PASS", "search": "WARN"}}, "out")


def sweep():
    show_sweep([Outcome(Job(i, (), f"{i}_ec_5dof_seed{i}"), "done", None, FULL) for i in range(2)], "out")


def filters():
    show_filters([FilterRow("gaussian_sum", 812.0, 25.0, 32.5, 105.0, 7.7)], "out")


def worst():
    print_table(terminal.console(), "t", ("job", "why", "error"), [["0_a", "declared, and the source is elsewhere", "71.3 mm"]], 2)


def drift():
    show_drift({}, [], "out")


@pytest.mark.parametrize("width", [60, 80, 200])
@pytest.mark.parametrize("shown", [summary, verdict, sweep, filters, worst, drift])
def test_no_table_is_wider_than_the_terminal_or_cut(shown, width, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", str(width))
    shown()
    told = capsys.readouterr().out
    assert max(map(cell_len, told.splitlines())) <= width and "…" not in told
    if shown is summary:
        assert told.count("174.6") == 4 and "declared" in told
    if shown is verdict:  # wrapped at words
        assert all(
            f"{c['found']} ({c['allowed']}) {c['action'] and '-> '}{c['action']}".strip() in " ".join(told.split()) for c in CRITERIA
        )
        assert not any(line.endswith(" ") for line in told[told.index("verdict") :].splitlines())


@pytest.mark.parametrize(("environment", "escapes"), [({"NO_COLOR": "1"}, False), ({"NO_COLOR": ""}, True), ({}, True)])
def test_no_color_means_no_escape_sequence_even_where_a_terminal_is_forced(environment, escapes):
    plain = {key: value for key, value in os.environ.items() if key not in ("NO_COLOR", "TERM")}
    forced = {**plain, "FORCE_COLOR": "1", "TERM": "xterm", **environment}
    done = subprocess.run([sys.executable, "-m", "oio.run", "--help"], cwd=ROOT, env=forced, capture_output=True, check=True)
    assert (b"\x1b" in done.stdout) is escapes


def test_the_version_is_the_projects_own():
    for words in (["--version"], ["sensor=ec", "--version"]):
        done = subprocess.run([sys.executable, "-m", "oio.run", *words], cwd=ROOT, capture_output=True, text=True, check=True)
        assert done.stdout == "oio 0.1.0\n" and done.stderr == ""


@pytest.mark.long
def test_no_color_leaves_no_escape_on_a_terminal_to_the_end_of_a_run(tmp_path):
    """A library restored the colour as the process ended."""
    main, side = os.openpty()
    words = ["sensor=ndir", "dof=1", "stage=[warm_up,baseline]", "report=false", f"hydra.run.dir={tmp_path / 'run'}"]
    env = {**os.environ, "NO_COLOR": "1", "TERM": "xterm-256color"}
    process = subprocess.Popen([sys.executable, "-m", "oio.run", *words], cwd=ROOT, env=env, stdout=side, stderr=subprocess.DEVNULL)
    os.close(side)
    seen = b""
    with contextlib.suppress(OSError):  # EIO: the other end is closed
        while piece := os.read(main, 4096):
            seen += piece
    os.close(main)
    assert process.wait() == 0 and b"verdict" in seen and b"\x1b" not in seen
