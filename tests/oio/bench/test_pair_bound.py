"""What a board can tell by the bound: a second place never makes it wider, and what is no board is refused."""

import csv

from oio.bench import __main__ as command


def test_a_second_place_tells_more(tmp_path, capsys):
    assert command.main(["pair_bound", "gamma=0.2", "poses=4", "seeds=3:5", "board=one_in_turn,two_together", f"out={tmp_path}/out"]) == 0
    with (tmp_path / "out" / "pair_bound.csv").open(encoding="utf-8") as file:
        one, two = csv.DictReader(file)
    assert float(one["ratio"]) == 1.0 and float(two["ratio"]) < 1.0 and one["paths"] == "2"
    assert "two_together" in capsys.readouterr().out


def test_a_board_that_is_none_is_refused(capsys):
    assert command.main(["pair_bound", "board=three"]) == 2
    assert "a board is one of" in capsys.readouterr().err
