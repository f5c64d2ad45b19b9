"""Poses anywhere in the box: the baseline that every search must beat."""

import numpy as np

from oio.core.records import Array
from oio.core.settings import settings
from oio.search.step_planning import random_step
from oio.search.view import View


@settings
class Random:
    """Uniform in the joints, as far as the nose may go there."""

    def propose(self, view: View, rng: np.random.Generator) -> Array:
        """The next joint goal (n,) rad."""
        return random_step(view, rng)
