"""The benchmark of two noses: pairs of boards on the same seed, and what its command leaves."""

import csv
from dataclasses import replace

import pytest

from oio.bench import __main__ as command
from oio.bench.boards import BoardCase, BoardTrial, rows
from oio.bench.score import Case
from tests.oio.bench.scores import GOOD

CASE = Case("ec", "still", 5, "d_optimal", "ekf")
ONE, TWO = BoardCase(CASE, "one_in_turn"), BoardCase(CASE, "two_together")
SHORT = (
    "stage.navigate.max_moves=6", "stage.map_beliefs.repeats=2", "stage.map_beliefs.budget_s=0", "stage.calibrate_bouts.moves_per_rung=2",
)  # fmt: skip


def trials(case, *scores):
    return [BoardTrial(case, seed, score, "" if score else "it broke") for seed, score in enumerate(scores)]


def test_boards_are_compared_in_pairs_of_one_seed():
    better, lost = replace(GOOD, error_mm=4.0, moves=30), replace(GOOD, declared=False, moves=120)
    found = rows([*trials(ONE, GOOD, lost, GOOD, None), *trials(TWO, better, better, None, better)])
    assert list(found) == [ONE, TWO]
    two = found[TWO]
    assert (two.trials, two.failed, two.found, two.pairs) == (4, 1, 3, 2)
    assert two.ratio == pytest.approx(0.5) and two.d_moves == pytest.approx(-55.0) and two.d_found == pytest.approx(0.5)
    assert found[ONE].ratio == 1.0 and found[ONE].found_low < 2 / 3 < found[ONE].found_high


def test_a_search_is_compared_with_the_first_in_the_same_air():
    other_search, other_air = (BoardCase(CASE._replace(**word), "two_together") for word in ({"search": "stereo"}, {"air": "draft"}))
    far = replace(GOOD, error_mm=2.0 * GOOD.error_mm)
    found = rows([*trials(ONE, GOOD), *trials(other_search, far), *trials(other_air, far)])
    assert found[other_search].ratio == pytest.approx(2.0) and found[other_air].ratio == 1.0


def test_a_wrong_declaration_is_not_found():
    found = rows(trials(ONE, replace(GOOD, wrong=True), GOOD))[ONE]
    assert (found.found, found.false) == (1, 1)


def test_a_board_is_places_and_sampling():
    assert TWO.words(0.06)[-2:] == ("arm.element_spacing_m=0.06", "backend.sampling=together")
    assert ONE.words(0.06)[-2:] == ("arm.element_spacing_m=0", "backend.sampling=in_turn")


@pytest.mark.parametrize(
    ("word", "told"),
    [("board=three", "a board is one of"), ("sensor=ndir", "takes two"), ("dof=2", "three joints at least"), ("spacing_m=-1", "above 0")],
)
def test_what_is_no_pair_is_refused(word, told, capsys):
    assert command.main(["stereo", "seeds=3", "air=still", "search=d_optimal", word]) == 2
    assert told in " ".join(capsys.readouterr().err.split())


@pytest.mark.slow
def test_the_command_leaves_its_tables(tmp_path, capsys):
    words = ["stereo", "air=steady", "dof=3", "search=stereo", "board=one_in_turn,two_together", "seeds=3", "jobs=1", f"out={tmp_path}/out"]
    assert command.main([*words, *SHORT]) == 0
    with (tmp_path / "out" / "stereo.csv").open(encoding="utf-8") as file:
        assert [row["board"] for row in csv.DictReader(file)] == ["one_in_turn", "two_together"]
    assert "two_together" in capsys.readouterr().out
