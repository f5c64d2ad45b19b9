"""Conformance tests of search strategies."""

import numpy as np

from oio.core.errors import BadInput
from oio.search.base import Strategy
from oio.search.view import View
from oio.testing.assertions import bitwise, require, require_frozen

SEEDS = 5


def check_strategy(strategy: Strategy, view: View) -> None:
    """Check a strategy: every goal is allowed for the arm; the same seed gives the same goal; the view is unchanged."""
    require_frozen(strategy)
    before = bitwise(view.belief) if view.belief is not None else []
    for seed in range(SEEDS):
        goal = strategy.propose(view, np.random.default_rng(seed))
        try:
            view.arm.validated(goal)
        except BadInput as error:
            raise AssertionError(f"a strategy proposes only what the arm may do: {error}") from None
        again = strategy.propose(view, np.random.default_rng(seed))
        require(np.asarray(goal).tobytes() == np.asarray(again).tobytes(), "the same view and seed give the same goal, bit for bit.")
    require((bitwise(view.belief) if view.belief is not None else []) == before, "a strategy does not change what it sees.")
