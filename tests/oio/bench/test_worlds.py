"""The benchmark of changed worlds: what its rows count, and that its command leaves what it says."""

import csv
from dataclasses import replace

import numpy as np
import pytest

from oio.bench import __main__ as command
from oio.bench.accuracy import plan_cases, write_trials
from oio.bench.arguments import read
from oio.bench.score import NEES_3_SIGMA, NEES_95, Case, Trial, scored
from oio.bench.trial_file import read_trials
from oio.bench.worlds import ALL, rows
from tests.oio.bench.scores import GOOD

WRONG = replace(GOOD, error_mm=90.0, nees=100.0, inside_95=False, in_region=False, wrong=True)
WALL, PLAIN = Case("ndir", "still", 5, "d_optimal", "ekf", "wall"), Case("ndir", "still", 5, "d_optimal", "ekf")
SHORT = (
    "stage.navigate.max_moves=7",
    "stage.map_beliefs.repeats=2",
    "stage.map_beliefs.budget_s=0",
    "stage.calibrate_bouts.moves_per_rung=2",
)


def test_wrong_answers_are_counted_where_they_were_declared_or_passed():
    scores = [GOOD, WRONG, replace(WRONG, passed=False), replace(WRONG, declared=False, passed=False)]
    trials = [Trial(WALL, seed, s, "") for seed, s in enumerate(scores)]
    row, together = rows(trials)
    assert (row.world, row.trials, row.declared, row.false, row.passed, row.wrong_pass) == ("wall", 4, 3, 2, 2, 1)
    assert row.false_share == pytest.approx(2 / 3) and row.wrong_pass_share == 0.5 and row.covered == 0.25
    assert row.false_low < 2 / 3 < row.false_high and row.median_mm == 90.0
    assert together.world == ALL and together.trials == 4


def test_worlds_have_rows_of_their_own_and_one_of_all():
    trials = [Trial(PLAIN, 0, GOOD, ""), Trial(WALL, 0, WRONG, ""), Trial(PLAIN, 1, None, "it broke")]
    plain, wall, together = rows(trials)
    assert (plain.trials, plain.failed, wall.failed) == (2, 1, 0)
    assert (together.trials, together.failed, together.declared, together.false) == (3, 1, 2, 1)


def test_without_a_declaration_there_is_no_share():
    (row, _) = rows([Trial(WALL, 0, replace(GOOD, declared=False, passed=False), "")])
    assert np.isnan(row.false_share) and np.isnan(row.wrong_pass_share)


def document(error_m, nees, **others):
    """The summary of a run, as far as it is scored."""
    outcome = {
        "source_error_m": error_m, "nees_source": nees, "inside_95": True, "found": True, "moves": 9, "time_s": 1.0, "nis_mean": None,
        "nose_error_m": None, "filtered_error_m": None, "filtered_nees": None, "world": "another wind", "other_places": [], **others,
    }  # fmt: skip
    return {
        "calibrated": outcome, "cold": outcome,
        "cold_open": outcome, "bound_m": None, "dead_reckoning": {"nose_error_m": None}, "verdict": "WARN",
        "calibration": {"time_s": 1.0, "error_ppm": 1.0, "u_a_ppm": 1.0, "u_b_m": 0.01},
    }  # fmt: skip


@pytest.mark.parametrize(
    ("error_m", "nees", "wrong"), [(0.029, NEES_3_SIGMA - 0.01, False), (0.031, 1.0, True), (0.005, NEES_3_SIGMA + 0.01, True)]
)
def test_wrong_is_far_off_or_outside_the_region(error_m, nees, wrong):
    score = scored(WALL, 1, document(error_m, nees), "", 30.0).score
    assert score is not None and (score.wrong, score.passed, score.assumed_world) == (wrong, False, "another wind")


@pytest.mark.parametrize(
    ("missed", "covered"), [([], False), ([NEES_95 - 0.1], True), ([50.0, NEES_95 - 0.1], True), ([NEES_95 + 0.1], False)]
)
def test_while_several_places_are_left_the_region_is_that_of_all_of_them(missed, covered):
    places = [{"believed_m": [0.3, 0.0, 0.2], "sd_m": 0.01, "world": "a second source", "nees_source": value} for value in missed]
    assert scored(WALL, 1, document(0.15, 100.0, inside_95=False, other_places=places), "", 30.0).score.in_region == covered
    assert rows([Trial(WALL, 1, replace(WRONG, in_region=True), "")])[0].covered_best == 0.0


def test_the_command_leaves_its_table_and_picture(tmp_path, capsys):
    words = ["worlds", "world=unchanged,wall", "sensor=ndir", "air=steady", "dof=3", "seeds=3", "jobs=1", f"out={tmp_path}/out", *SHORT]
    assert command.main(words) == 0
    with (tmp_path / "out" / "worlds.csv").open(encoding="utf-8") as file:
        table = list(csv.DictReader(file))
    assert [row["world"] for row in table] == ["unchanged", "wall", "all"]
    assert (tmp_path / "out" / "worlds.png").stat().st_size > 10_000
    told = capsys.readouterr().out
    assert "declared, but wrong" in told and "wall" in told


def test_worlds_have_seeds_of_their_own_unless_they_are_to_share_them():
    words = ["world=unchanged,wall,box", "sensor=ndir", "air=still", "seeds=7000:7003"]
    for apart, begins in ((["apart=true"], [7000, 7003, 7006]), (["apart=false"], [7000] * 3), ([], [7000, 7003, 7006])):
        tasks = plan_cases(read("worlds", [*words, *apart])).tasks
        assert [seed for _, seed in tasks] == [first + i for first in begins for i in range(3)]


def made(folder, trials):
    folder.mkdir()
    write_trials(trials, folder)
    return str(folder)


def test_earlier_runs_are_one_table_by_world(tmp_path, capsys):
    one = made(tmp_path / "a", [Trial(PLAIN, 0, GOOD, ""), Trial(WALL, 0, WRONG, "")])
    other = made(tmp_path / "b", [Trial(WALL._replace(air="draft"), 0, GOOD, ""), Trial(PLAIN, 1, None, "it broke")])
    assert command.main(["worlds", f"from={one},{other}", "by=world", f"out={tmp_path / 'out'}"]) == 0
    with (tmp_path / "out" / "worlds.csv").open(encoding="utf-8") as file:
        assert [(row["world"], row["air"]) for row in csv.DictReader(file)] == [
            ("unchanged", "still"), ("wall", "still"), ("wall", "draft"), ("all", ""),
        ]  # fmt: skip
    assert read_trials([str(tmp_path / "out")]) == read_trials([one, other]) and (tmp_path / "out" / "worlds.png").is_file()
    told = capsys.readouterr().out
    assert "1 failed: it broke" in told and "draft" not in told and "sensor" not in told
    (_, wall, _) = rows(read_trials([one, other]), ("world",))
    assert (wall.trials, wall.false, wall.sensor) == (2, 1, "")


@pytest.mark.parametrize(("words", "told"), [
    (["from=nowhere"], "nowhere/trials.csv cannot be read"),
    (["from={a},{a2}"], "seed 0 of ndir/still/5/d_optimal/ekf/unchanged is in two of the folders"),
    (["from={b}"], "has other columns than this version writes"),
    (["from={c}"], "has a row that cannot be read"),
    (["by=seed"], "rows are by world, sensor, air"),
    (["apart=perhaps"], "apart is true or false"),
])  # fmt: skip
def test_what_is_no_earlier_run_is_refused(words, told, tmp_path, capsys):
    for name in ("a", "a2"):
        made(tmp_path / name, [Trial(PLAIN, 0, GOOD, "")])
    for name, text in (("b", "x,y\n1,2\n"), ("c", (tmp_path / "a" / "trials.csv").read_text().replace("True", "perhaps"))):
        (tmp_path / name).mkdir()
        (tmp_path / name / "trials.csv").write_text(text)
    filled = [word.format(**{name: tmp_path / name for name in ("a", "a2", "b", "c")}) for word in words]
    assert command.main(["worlds", *filled, f"out={tmp_path / 'out'}"]) == 2
    assert told in " ".join(capsys.readouterr().err.split()) and not (tmp_path / "out").exists()


def test_a_world_that_does_not_exist_is_refused(capsys):
    assert command.main(["worlds", "world=moon", "seeds=3"]) == 2
    assert "world can be" in capsys.readouterr().err
