"""Searches side by side: each is the search of a run of its own, on a bench that is calibrated once for all of them."""

import csv

import numpy as np
import pytest

from oio.bench import __main__ as command
from oio.bench import searches
from oio.bench.searches import Search, show
from oio.bench.trial import run_trial
from oio.core.errors import BadInput

SHORT = (
    "stage.navigate.max_moves=6",
    "stage.map_beliefs.repeats=2",
    "stage.map_beliefs.budget_s=0",
    "stage.calibrate_bouts.moves_per_rung=1",
)


def test_a_search_is_that_of_a_run(tmp_path, monkeypatch, capsys):
    calibrated, made = [], searches.made
    monkeypatch.setattr(searches, "made", lambda *words: calibrated.append(words) or made(*words))
    words = ["searches", "sensor=ndir", "dof=3", "search=random,gradient", "seeds=3", "jobs=1", *SHORT]
    assert command.main([*words, f"out={tmp_path / 'found'}"]) == 0
    assert "gradient" in capsys.readouterr().out and len(calibrated) == 1
    with (tmp_path / "found" / "searches.csv").open(encoding="utf-8") as file:
        rows = {row["search"]: row for row in csv.DictReader(file)}
    for name in ("random", "gradient"):
        run = run_trial(("sensor=ndir", "air=still", "dof=3", f"search={name}", *SHORT), 3)["calibrated"]
        assert float(rows[name]["error_mm"]) == pytest.approx(1e3 * run["source_error_m"], rel=1e-9)
        assert (int(rows[name]["moves"]), rows[name]["declared"]) == (run["moves"], str(run["found"]))


def test_a_bench_that_fails_fails_all_its_searches(monkeypatch):
    def refused(*_):
        raise BadInput("no bench")

    monkeypatch.setattr(searches, "made", refused)
    found = searches.searched_all(("ec", "still"), 1, ("random", "bandit"), (), 3.0)
    assert [(one.search, one.reason) for one in found] == [("random", "no bench"), ("bandit", "no bench")]


def test_rows_count_what_was_declared_and_right(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "160")
    right = Search("ec", "still", "random", 1, 5.0, True, False, 40, 30.0)
    wrong, open_, broken = (
        Search("ec", "still", "random", 2, 80.0, True, True, 60, 50.0),
        Search("ec", "still", "random", 3, 20.0, False, False, 120, 90.0),
        Search("ec", "still", "random", 4, np.nan, False, False, 0, np.nan, "it broke"),
    )
    show([right, wrong, open_, broken], ["random"], "here")
    told = capsys.readouterr().out
    assert "4 (1)" in told and "33 [" in told and "1 of 2" in told and "20.0 / " in told and "1 failed: it broke" in told
