"""Poses anywhere in the box: the baseline that every search must beat."""

import numpy as np

from oio.records import Array
from oio.search.steps import anywhere
from oio.search.view import View
from oio.settings import settings


@settings
class Random:
    """Uniform in the joints, as far as the nose may go there."""

    def propose(self, view: View, rng: np.random.Generator) -> Array:
        """The next joint goal (n,) rad."""
        return anywhere(view, rng)
