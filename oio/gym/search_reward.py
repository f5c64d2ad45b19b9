"""Rewards of a search in nats: what the belief of the source has gained, less what time costs."""

from typing import Protocol

import numpy as np

from oio.core.errors import BadInput
from oio.core.records import Array
from oio.kinematics.arm import Arm

WORST = -10.0  # a log score below this counts as this: a belief that excludes the truth must not decide a whole training

Source = tuple[Array, Array]  # mean (3,) m and covariance (3, 3) m^2


class Worth(Protocol):
    """What a belief of the source is worth [nats]; none at all: zero."""

    def __call__(self, source: Source | None, truth_m: Array | None, arm: Arm) -> float:
        """Of mean and covariance, and the true place (3,) m, which not every worth looks at."""
        ...


def information(source: Source | None, truth_m: Array | None, arm: Arm) -> float:
    """Half of the reduction of ln det of the covariance since it was that of a place anywhere in the workspace box; no truth is used."""
    if source is None:
        return 0.0
    anywhere = np.square(np.subtract(arm.box_high_m, arm.box_low_m)) / 12.0
    return 0.5 * float(np.sum(np.log(anywhere)) - np.linalg.slogdet(source[1])[1])


def log_score(source: Source | None, truth_m: Array | None, arm: Arm) -> float:
    """Logarithm of the density that the belief gives the true place, over that of the workspace box: a proper score (Good 1952)."""
    if source is None or truth_m is None or not np.all(np.isfinite(truth_m)):
        return 0.0
    mean, cov = source
    miss = truth_m - mean
    ln_density = -0.5 * float(miss @ np.linalg.solve(cov, miss) + np.linalg.slogdet(cov)[1] + 3.0 * np.log(2.0 * np.pi))
    volume = float(np.sum(np.log(np.subtract(arm.box_high_m, arm.box_low_m))))
    return max(ln_density + volume, WORST)


WORTHS: dict[str, Worth] = {"information": information, "log_score": log_score}


def worth_of(name: str) -> Worth:
    """The worth of that name. Raises BadInput for another."""
    if name not in WORTHS:
        raise BadInput(f"reward is {name!r}, but it can be {' or '.join(WORTHS)}. Type reward='information'.")
    return WORTHS[name]
