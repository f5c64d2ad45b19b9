"""`searching` and `calibrating` make environments whose benches are made in a second or two; without gymnasium no test is collected."""

import importlib.util

import pytest

if importlib.util.find_spec("gymnasium") is None:
    collect_ignore_glob = ["test_*.py"]

QUICK = {"stage.calibrate_bouts.moves_per_rung": 1, "stage.map_beliefs.repeats": 2, "stage.map_beliefs.budget_s": 0}


def _made(name, **words):
    import gymnasium

    import oio.gym  # noqa: F401  # registers

    return gymnasium.make(name, **{"sensor": "ndir", "dof": 3, "bench_seeds": (3,), **words})


@pytest.fixture
def searching():
    def made(moves=8, overrides=None, **words):
        return _made("OIO/Search-v0", overrides={**QUICK, "stage.navigate.max_moves": moves, **(overrides or {})}, **words)

    return made


@pytest.fixture
def calibrating():
    def made(overrides=None, **words):
        return _made("OIO/Calibrate-v0", overrides=overrides, **words)

    return made
