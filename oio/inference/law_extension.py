"""Extension of the range law to worlds that calibration did not see: a second source, and strength, wind or background that change.

What changes is piecewise linear between knots, with the prior of a random walk (Wiener process) from the first knot on, whose density is
in units of the parameter per square root of a second. `oio.inference.extension_kernel.Knots` has the order of the parameters.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from oio.core.records import Array
from oio.gas.second_source import ALONE
from oio.inference.extension_kernel import Knots


@dataclass(frozen=True, slots=True)
class Densities:
    """Densities of random walks: ln strength [1/sqrt(s)], wind [1/m/sqrt(s)], background [ppm/sqrt(s)]."""

    strength: float = 0.0
    wind: float = 0.0
    background_ppm: float = 0.0


@dataclass(frozen=True)
class LawExtension:
    """Extension: a second source or none, knots [s] of the random walks, and their densities."""

    second_source: int = ALONE  # or ANOTHER, MIRRORED
    strength_s: tuple[float, ...] = ()
    wind_s: tuple[float, ...] = ()
    background_s: tuple[float, ...] = ()
    densities: Densities = Densities()

    @cached_property
    def knots(self) -> Knots:
        """The extension for the compiled forward model."""
        return Knots(self.second_source, np.array(self.strength_s), np.array(self.wind_s), np.array(self.background_s))

    @cached_property
    def size(self) -> int:
        """Number of parameters."""
        return self.background.stop

    @property
    def second(self) -> range:
        """Indices of the second source and its ln strength over the first's, from the end of the law's own parameters."""
        return range(4 if self.second_source else 0)

    @property
    def strength(self) -> range:
        """Indices of the changes of ln strength."""
        return range(self.second.stop, self.second.stop + max(len(self.strength_s) - 1, 0))

    @property
    def wind(self) -> range:
        """Indices of the changes of the wind: x, y, z at one knot, then at the next."""
        return range(self.strength.stop, self.strength.stop + 3 * max(len(self.wind_s) - 1, 0))

    @property
    def background(self) -> range:
        """Indices of the changes of the background."""
        return range(self.wind.stop, self.wind.stop + max(len(self.background_s) - 1, 0))


UNEXTENDED = LawExtension()


def random_walk_cov(knots_s: tuple[float, ...], density: float) -> Array:
    """Covariance (k - 1, k - 1) of a random walk at all knots but the first: density^2 min(t_i, t_j)."""
    t = np.array(knots_s[1:]) - (knots_s[0] if knots_s else 0.0)
    return np.asarray(density**2 * np.minimum(t[:, None], t[None, :]))
