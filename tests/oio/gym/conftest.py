"""`searching` and `calibrating` make environments whose benches are made in a second or two; without gymnasium their tests are skipped."""

import pytest

gymnasium = pytest.importorskip("gymnasium")

QUICK = {"stage.calibrate_bouts.moves_per_rung": 1, "stage.map_beliefs.repeats": 2, "stage.map_beliefs.budget_s": 0}


@pytest.fixture
def searching():
    import oio.gym  # noqa: F401  # registers

    def made(moves=8, overrides=None, **words):
        told = {**QUICK, "stage.navigate.max_moves": moves, **(overrides or {})}
        return gymnasium.make("OIO/Search-v0", **{"sensor": "ndir", "dof": 3, "bench_seeds": (3,), **words}, overrides=told)

    return made


@pytest.fixture
def calibrating():
    import oio.gym  # noqa: F401

    def made(overrides=None, **words):
        return gymnasium.make("OIO/Calibrate-v0", **{"sensor": "ndir", "dof": 3, "bench_seeds": (3,), **words}, overrides=overrides)

    return made
