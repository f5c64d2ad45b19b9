"""When a source is declared: the belief is narrow, the nose has smelt it from near, and the filter is not surprised. No truth in it."""

import numpy as np

from oio.core.settings import in_range, settings
from oio.estimators.odometry import Odometry
from oio.search.view import Move


@settings
class StopRule:
    """Self-declared success; checked at the end of every move, and again after a map of everything."""

    sd_m: float  # root of the trace of the source's covariance is below this,
    sniff_radius_m: float  # the nose has sniffed within this of the believed source,
    min_sniffs: int  # so many times, with bouts,
    max_nis: float  # one hypothesis is left, and the mean NIS since the last map is below this

    def check(self) -> None:
        """Refuse a rule that never or always holds."""
        in_range(self, sd_m=(1e-5, 10), sniff_radius_m=(1e-3, 10), min_sniffs=(1, 1000), max_nis=(1, 1e6))

    def holds(self, odometry: Odometry, moves: tuple[Move, ...]) -> bool:
        """Whether the source may be declared after these moves."""
        source = odometry.source()
        if source is None or odometry.belief is None or len(odometry.hypotheses) > 1 or not odometry.consistent(self.max_nis):
            return False
        model = odometry.prior.model
        noses = model.arm.nose(np.array([move.q for move in moves]) - odometry.belief.mean[model.at["o"]])
        smelt = np.array([move.bouts > 0 for move in moves])
        near = np.count_nonzero((np.linalg.norm(noses - source[0], axis=1) < self.sniff_radius_m) & smelt)
        return bool(near >= self.min_sniffs and np.sqrt(np.trace(source[1])) < self.sd_m)
