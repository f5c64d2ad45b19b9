"""Extension of the range law to worlds that calibration did not see: a source of another shape, strength, wind or background that change,
and encoders that drift otherwise.

What changes is piecewise linear between knots, with the prior of a random walk (Wiener process) from the first knot on, whose density is
in units of the parameter per square root of a second. `oio.inference.extension_kernel.Knots` has the order of the parameters.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from oio.core.records import Array
from oio.gas.source_shape import PARAMETERS, POINT
from oio.inference.extension_kernel import Knots


@dataclass(frozen=True, slots=True)
class Densities:
    """Densities of random walks: ln strength [1/sqrt(s)], wind [1/m/sqrt(s)], background [ppm/sqrt(s)]."""

    strength: float = 0.0
    wind: float = 0.0
    background_ppm: float = 0.0


@dataclass(frozen=True)
class LawExtension:
    """Extension: kind of the source's shape, knots [s] of the random walks, their densities, and how many joints drift otherwise from
    `begins_s`, the first reading, on (all, or none)."""

    source: int = POINT  # or another kind of `oio.gas.source_shape`
    strength_s: tuple[float, ...] = ()
    wind_s: tuple[float, ...] = ()
    background_s: tuple[float, ...] = ()
    densities: Densities = Densities()
    joints: int = 0
    begins_s: float = 0.0

    @cached_property
    def knots(self) -> Knots:
        """The extension for the compiled forward model."""
        return Knots(self.source, np.array(self.strength_s), np.array(self.wind_s), np.array(self.background_s), self.joints)

    @cached_property
    def size(self) -> int:
        """Number of parameters."""
        return self.background.stop

    @property
    def shape(self) -> range:
        """Indices, from the end of theta without the extension, of the parameters of the source's shape."""
        return range(int(PARAMETERS[self.source]))

    @property
    def strength(self) -> range:
        """Indices of the changes of ln strength."""
        return range(self.shape.stop, self.shape.stop + max(len(self.strength_s) - 1, 0))

    @property
    def wind(self) -> range:
        """Indices of the changes of the wind: x, y, z at one knot, then at the next."""
        return range(self.strength.stop, self.strength.stop + 3 * max(len(self.wind_s) - 1, 0))

    @property
    def drift(self) -> range:
        """Indices of the additional drift of the joints [rad/s^2]."""
        return range(self.wind.stop, self.wind.stop + self.joints)

    @property
    def background(self) -> range:
        """Indices of the changes of the background."""
        return range(self.drift.stop, self.drift.stop + max(len(self.background_s) - 1, 0))


UNEXTENDED = LawExtension()


def random_walk_cov(knots_s: tuple[float, ...], density: float) -> Array:
    """Covariance (k - 1, k - 1) of a random walk at all knots but the first: density^2 min(t_i, t_j)."""
    t = np.array(knots_s[1:]) - (knots_s[0] if knots_s else 0.0)
    return np.asarray(density**2 * np.minimum(t[:, None], t[None, :]))
