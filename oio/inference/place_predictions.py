"""Predicted readings of elements that are at one place or at two: one pass of the forward model along the path for each place."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from oio.core.records import Array
from oio.gas.trace import Sniffs
from oio.inference.extension_kernel import Knots, LawScale
from oio.inference.forward_kernel import ExpectedPath, Lag, SensedPath, predict_readings
from oio.kinematics.serial_arm import SerialArm


@dataclass(frozen=True, slots=True, eq=False)
class PlacePredictions:
    """`forward`: one for each place from which there are readings; which readings (m,) are from the last; places of the board."""

    forward: tuple[ExpectedPath, ...]
    is_second: NDArray[np.bool_]
    places: int

    @property
    def ppm(self) -> Array:
        """Predicted readings without offsets (m,) [ppm]."""
        return self.forward[0].ppm if len(self.forward) == 1 else self._merged(*(f.ppm for f in self.forward))

    @property
    def rows(self) -> Array:
        """Jacobian of the readings (m, P), or (0, P)."""
        if len(self.forward) == 1 or not len(self.forward[0].rows):
            return self.forward[0].rows
        return self._merged(*(f.rows for f in self.forward))

    @property
    def gain(self) -> Array:
        """Gain of each reading's element (m,)."""
        return self.forward[0].gain if len(self.forward) == 1 else self._merged(*(f.gain for f in self.forward))

    @property
    def lagged_ppm_at(self) -> tuple[float, ...]:
        """Lagged concentration [ppm] at the end of the path at each of two places; empty for one place. One without readings has the
        other's."""
        if self.places == 1:
            return ()
        return float(self.forward[0].lagged_ppm), float(self.forward[-1].lagged_ppm)

    def _merged(self, first: Array, second: Array) -> Array:
        out = np.empty((len(self.is_second), *first.shape[1:]))
        out[~self.is_second], out[self.is_second] = first, second
        return out


def predict_places(
    theta: Array, sniffs: Sniffs, arm: SerialArm, elements: int, law: LawScale, lag: Lag, knots: Knots, want_rows: bool
) -> PlacePredictions:
    """Predict the readings at theta (P,), with their Jacobian if it is wanted. The first reading from a place initialises the lag there."""
    place_of = arm.place_of(elements)
    place, forward = np.array(place_of)[sniffs.element], list[ExpectedPath]()
    for i in np.unique(place):
        here = place == i
        path = SensedPath(sniffs.t_s, sniffs.q, sniffs.at[here], sniffs.element[here])
        forward.append(predict_readings(theta, path, sniffs.ppm[here][0], arm.adjoints[i], law, lag, knots, want_rows))
    return PlacePredictions(tuple(forward), place == place.max(), max(place_of) + 1)
