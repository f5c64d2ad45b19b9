"""What a person sees at the end: every unit, every name as it is."""

import pytest

from oio.cli.console import show_summary
from oio.sweep.job_table import show_sweep
from oio.sweep.manifest import Job, Outcome

OUTCOME = {
    "source_error_m": 0.0123, "sd_m": 0.01, "nose_error_m": 0.004, "nees_source": 2.0, "inside_95": True, "nis_mean": 1.0,
    "moves": 30, "time_s": 61.0, "found": True,
}  # fmt: skip
BEARING = {**OUTCOME, "source_error_m": None, "bearing_error_deg": 3.21}


def document(outcome):
    return {
        "sensor": "ec", "profile": "paper", "dof": 5, "air": "still", "seed": 7,
        "cold": outcome, "cold_open": outcome, "calibrated": outcome,
        "calibrated_paper_assembly": None, "dead_reckoning": {"nose_error_m": 0.02}, "bound_m": 0.009, "bound_ratio": 1.4,
        "posterior_bound_m": 0.006, "posterior_bound_ratio": 2.1,
        "calibration": {"time_s": 80.0, "moves": 40, "u_a_ppm": 0.4, "u_b_m": 0.006, "error_ppm": 1.5},
        "verdict": "WARN", "reasons": ["no [sense] in it."], "scored": {"word": "RIGHT", "reasons": []}, "wall_s": 4.0,
    }  # fmt: skip


def test_the_error_stands_over_both_bounds(capsys):
    show_summary(document(OUTCOME), "runs/1")
    said = capsys.readouterr().out
    assert "error / bound 1.40 (Cramer-Rao 9.0 mm; van Trees, the mean" in said and "6.0 mm)" in said
    show_summary({**document(OUTCOME), "bound_m": None, "bound_ratio": None}, "runs/1")
    assert "error / bound" not in capsys.readouterr().out


@pytest.mark.parametrize(("outcome", "head"), [(OUTCOME, ("source", "[mm]")), (BEARING, ("bearing", "[deg]"))])
def test_the_summary_has_its_units(capsys, outcome, head):
    show_summary(document(outcome), "runs/[old]/1")
    said = capsys.readouterr().out
    for word in (*head, "+- [mm]", "nose error", "time [s]", "no [sense] in it.", "runs/[old]/1"):
        assert word in said, said


def test_the_sweep_has_its_units_and_names(capsys):
    rows = [
        Outcome(Job(0, (), "0_[a]"), "done", None, document(OUTCOME)),
        Outcome(Job(1, (), "1_[b]"), "failed", "[no]", None),
    ]
    show_sweep(rows, "runs/[old]")
    said = capsys.readouterr().out
    for word in ("2 jobs, runs/[old]", "cold [mm]", "calibrated [mm]", "cal. time [s]", "u_a [ppm]", "wall [s]", "0_[a]", "1_[b]", "[no]"):
        assert word in said, said


def test_the_score_stands_apart_from_the_verdict(capsys):
    show_summary({**document(OUTCOME), "scored": {"word": "WRONG", "reasons": ["far off."]}}, "runs/1")
    said = capsys.readouterr().out
    assert "verdict WARN: from what a bench can see\n  - no [sense] in it.\nscored WRONG, against the truth" in said and "far off." in said
    show_summary({**document(OUTCOME), "scored": {"word": "unknown", "reasons": []}}, "runs/1")
    assert "scored" not in capsys.readouterr().out


def test_the_filter_alone_has_a_row_of_its_own(capsys):
    """A map precedes every end, so the answer is the map's; what the filter made of the readings since the one before stands below it."""
    show_summary(document({**OUTCOME, "filtered_error_m": 0.0471, "filtered_nees": 5.4}), "runs/1")
    (line,) = [line for line in capsys.readouterr().out.splitlines() if "the filter alone" in line]
    assert "47.1" in line and "5.4" in line


def test_a_summary_of_schema_1_can_be_shown(capsys):
    old = {key: value for key, value in document(OUTCOME).items() if key not in ("scored", "cold_open")}
    show_summary(old, "runs/1")
    assert "cold start" in capsys.readouterr().out
