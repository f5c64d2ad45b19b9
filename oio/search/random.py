"""Random search: random poses in the workspace box, the baseline for every other strategy."""

import numpy as np

from oio.core.records import Array
from oio.core.settings import settings
from oio.search.step_planning import random_step
from oio.search.view import View


@settings
class Random:
    """Random strategy: poses uniform in the joints, among those the arm may move to."""

    def propose(self, view: View, rng: np.random.Generator) -> Array:
        """Return the next joint goal (n,) rad."""
        return random_step(view, rng)
