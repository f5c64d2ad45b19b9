"""What a search strategy must offer."""

from typing import Protocol, runtime_checkable

import numpy as np

from oio.core.records import Array
from oio.search.view import View


@runtime_checkable
class Strategy(Protocol):
    """Where to move the nose next."""

    def propose(self, view: View, rng: np.random.Generator) -> Array:
        """The next joint goal (n,) rad."""
        ...
