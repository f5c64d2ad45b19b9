"""Stopping rule: declares the source when the belief is narrow, the nose sniffed gas near it, and the filter foresaw the latest readings.

It uses no truth.
"""

from typing import Annotated

import numpy as np

from oio.core.settings import Within, settings
from oio.estimators.odometry import Odometry
from oio.search.view import Move


@settings
class StopRule:
    """Stopping rule (self-declared success); checked after every move, and again after a map of the whole trace."""

    sd_m: Annotated[float, Within(1e-5, 1)]  # root of the trace of the source's covariance is below this,
    sniff_radius_m: Annotated[float, Within(1e-3, 10)]  # the nose has sniffed within this of the believed source,
    min_sniffs: Annotated[int, Within(1, 1000)]  # so many times, with bouts,
    # max_nis: one hypothesis is left, and the mean NIS of the latest readings, those before the map included, is below this
    max_nis: Annotated[float, Within(1, 1e6)]
    # max_halves: two halves of the readings agree on the source: their squared Mahalanobis distance is below this
    max_halves: Annotated[float, Within(1, 1e6)]

    def may_declare(self, odometry: Odometry, moves: tuple[Move, ...]) -> bool:
        """Return whether the source may be declared after these moves."""
        source = odometry.source()
        if source is None or odometry.belief is None or len(odometry.hypotheses) > 1 or not odometry.verified(self.max_nis):
            return False
        residuals = odometry.hypotheses[0].residuals if odometry.hypotheses else None
        if residuals is not None and residuals.halves >= self.max_halves:
            return False
        model = odometry.model
        noses = model.arm.nose(np.array([move.q for move in moves]) - odometry.belief.mean[model.at["o"]])
        with_bouts = np.array([move.bouts > 0 for move in moves])
        near_sniffs = np.count_nonzero((np.linalg.norm(noses - source[0], axis=1) < self.sniff_radius_m) & with_bouts)
        return bool(near_sniffs >= self.min_sniffs and np.sqrt(np.trace(source[1])) < self.sd_m)
