"""Figures over seeds."""

import io

import pytest
from rich.console import Console

from oio.sweep.seed_table import group_by_case, group_figures, show_groups


def run(seed, cold, calibrated, sensor="ec", inside=True):
    outcome = {"inside_95": inside}
    return {
        "sensor": sensor, "dof": 5, "air": "still", "seed": seed, "calibration": {"time_s": 80.0},
        "cold": {**outcome, "source_error_m": cold}, "calibrated": {**outcome, "source_error_m": calibrated},
    }  # fmt: skip


def test_medians_wins_and_coverage():
    runs = [run(0, 0.05, 0.01), run(1, 0.02, 0.03, inside=False), run(2, 0.09, 0.02)]
    found = group_figures(runs)
    assert (found["cold_m"], found["calibrated_m"], found["beats"]) == (0.05, 0.02, 2)
    assert found["covered"] == pytest.approx(2 / 3)


def test_groups_are_by_sensor_and_leave_out_what_has_no_position():
    runs = [run(0, 0.05, 0.01), run(1, 0.05, 0.01, sensor="pa"), run(2, None, None)]
    assert {key: len(value) for key, value in group_by_case(runs).items()} == {("ec", 5, "still"): 1, ("pa", 5, "still"): 1}


def test_the_table_needs_two_seeds():
    out = io.StringIO()
    show_groups([run(0, 0.05, 0.01)], Console(file=out, width=140))
    assert out.getvalue() == ""
    show_groups([run(0, 0.05, 0.01), run(1, 0.06, 0.02)], Console(file=out, width=140))
    assert "2 of 2" in out.getvalue() and "55.0" in out.getvalue()


def test_units_are_not_taken_for_markup():
    out = io.StringIO()
    show_groups([run(0, 0.05, 0.01), run(1, 0.06, 0.02)], Console(file=out, width=140))
    assert "source error over seeds [mm]" in out.getvalue() and "cal. time [s]" in out.getvalue()
