"""Jobs that may have stages in common go to one process."""

from pathlib import Path

from oio.sweep.bundles import bundles
from oio.sweep.manifest import Job
from oio.sweep.worker import Work


def works(*all_words):
    return [Work(Job(i, words, str(i)), Path(str(i))) for i, words in enumerate(all_words)]


def numbers(found):
    return [[work.job.number for work in bundle] for bundle in found]


def test_filters_of_one_seed_are_together_and_every_process_has_a_share():
    grid = works(*((f"ekf={ekf}", f"seed={seed}") for ekf in ("ekf", "ukf") for seed in (0, 1)))
    assert numbers(bundles(grid, 2)) == [[0, 2], [1, 3]]
    assert numbers(bundles(grid[:1] + grid[2:3], 2)) == [[0], [2]]  # two processes, one seed
    assert numbers(bundles(grid, 1)) == [[0, 2], [1, 3]]
    assert numbers(bundles([], 2)) == []


def test_many_values_of_one_truth_are_told_before_all_have_ended():
    many = works(*((f"stage.navigate.dwell_s={v}", "seed=0") for v in range(20)))
    assert [len(bundle) for bundle in bundles(many, 2)] == [8, 8, 4]


def test_keys_that_only_begin_alike_are_others():
    assert numbers(bundles(works(("ekf_more=1",), ("ekf.gate=2",), ("+search=x",), ("stage.navigate_more=1",)), 1)) == [[0], [1, 2], [3]]
