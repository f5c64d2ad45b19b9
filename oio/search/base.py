"""Search strategy protocol."""

from typing import Protocol, runtime_checkable

import numpy as np

from oio.core.records import Array
from oio.search.view import View


@runtime_checkable
class Strategy(Protocol):
    """Search strategy: chooses where to move the nose next."""

    def propose(self, view: View, rng: np.random.Generator) -> Array:
        """Return the next joint goal (n,) rad."""
        ...
