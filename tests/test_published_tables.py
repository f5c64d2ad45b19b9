"""The tables of README and of the benchmark page are those of the CSV files beside them, to the digit.

`python tests/test_published_tables.py` prints them, to be pasted after a benchmark was made anew.
"""

import csv
import sys
from pathlib import Path

import pytest

from oio.bench.score import NEES_3_SIGMA
from oio.bench.trial_file import read_csv
from oio.bench.worlds import rows

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
PAGES = {name: (ROOT / name).read_text(encoding="utf-8") for name in ("README.md", "docs/how-to/benchmark.md")}
FAR_MM = 30.0  # three times stop.sd_m
ARMS = {"ur5e": "UR5e", "franka": "Franka"}
AIRS = ("steady", "still", "draft", "ventilated")


def accuracy_lines():
    """A line per sensor: median (95 %), the better cold start, share in the 95 % region, by air."""
    with (DOCS / "accuracy.csv").open(encoding="utf-8", newline="") as file:
        cells = {(row["sensor"], row["air"]): row for row in csv.DictReader(file)}
    return [f"| {sensor} | {' | '.join(_accuracy(cells[sensor, air]) for air in AIRS)} |" for sensor in dict.fromkeys(s for s, _ in cells)]


def _accuracy(row):
    number = {key: float(row[key]) for key in ("median_mm", "p95_mm", "cold_mm", "cold_open_mm", "covered")}
    cold = min(number["cold_mm"], number["cold_open_mm"])
    return f"{number['median_mm']:.1f} ({number['p95_mm']:.0f}), cold {cold:.0f}, {100 * number['covered']:.0f} %"


def worlds_lines():
    """A line per world: median (95 %), in the 95 % region, declared, of these wrong, PASS and wrong; the last of all."""
    found = rows(read_csv(DOCS / "worlds_trials.csv"), ("world",))
    return [
        f"| {r.world} | {r.median_mm:.0f} ({r.p95_mm:.0f}) | {round(r.covered * (r.trials - r.failed))} of {r.trials} | {r.declared} | "
        f"{r.false} | {r.wrong_pass} of {r.passed} |"
        for r in found
    ]


def arms_lines():
    """A line per arm and air: median with its interval, 90 %, in the 95 % region, declared, the cold start."""
    with (DOCS / "arms.csv").open(encoding="utf-8", newline="") as file:
        rows = [({key: float(row[key]) for key in row if key not in ("arm", "sensor", "air", "unit")}, row) for row in csv.DictReader(file)]
    return [
        f"| {ARMS[row['arm']]}, {row['dof']} joints | {row['air']} | {n['median']:.1f} [{n['median_low']:.1f}, {n['median_high']:.1f}] | "
        f"{n['p90']:.1f} | {round(n['inside_95'] * n['jobs'])} of {row['jobs']} | {round(n['declared'] * n['jobs'])} | {n['cold']:.1f} |"
        for n, row in rows
    ]


def test_the_table_of_arms_and_what_was_promised_of_them():
    """Six and seven joints: ten seeds per air, a median of 20 mm at most, and eight of ten regions that contain the source."""
    page = (DOCS / "how-to" / "bring_your_arm.md").read_text(encoding="utf-8")
    assert all(line in page for line in arms_lines()), "\n".join(arms_lines())
    with (DOCS / "arms.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert {(row["dof"], row["air"]) for row in rows} == {("6", "still"), ("6", "draft"), ("7", "still"), ("7", "draft")}
    assert all(row["jobs"] == "10" and float(row["median"]) <= 20.0 and float(row["inside_95"]) >= 0.8 for row in rows)


@pytest.mark.parametrize("page", PAGES)
def test_the_accuracy_table(page):
    for line in accuracy_lines():
        assert line in PAGES[page], line


def test_the_table_of_worlds():
    for line in worlds_lines():
        assert line in PAGES["docs/how-to/benchmark.md"], line


@pytest.mark.parametrize("name", ["worlds_trials.csv", "stereo_trials.csv"])
def test_wrong_is_what_the_benchmark_calls_wrong(name):
    with (DOCS / name).open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            assert row["reason"] or (row["wrong"] == "True") == (float(row["error_mm"]) > FAR_MM or float(row["nees"]) > NEES_3_SIGMA)


if __name__ == "__main__":
    sys.stdout.write("\n".join([*accuracy_lines(), "", *worlds_lines(), "", *arms_lines(), ""]))
