"""Nose position error of the filter and of dead reckoning, at the instants of the readings."""

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtri

from oio.core.records import Array, JointState, Truth, seconds
from oio.inference.metrics import COVERAGE, nees
from oio.kinematics.arm import Arm
from oio.log import MemoryLog


class NoseLog(MemoryLog):
    """In-memory log that also keeps the believed nose positions."""

    def __init__(self) -> None:
        super().__init__()
        self.noses: list[tuple[int, Array, Array]] = []

    def odometry(self, t_ns: int, nose_m: Array, cov: Array) -> None:
        """Keep the believed nose position and its covariance."""
        self.noses.append((t_ns, np.array(nose_m), np.array(cov)))


@dataclass(frozen=True)
class NoseErrorSample:
    """Nose errors in a window before `after_s`: RMS errors and RMS claimed standard deviation in mm, share inside the 95 % region."""

    after_s: float
    nose_mm: float
    dead_reckoning_mm: float
    claimed_mm: float
    inside_95: float


def errors(log: NoseLog, arm: Arm, began_ns: int) -> Array:
    """Return per instant: seconds since the start, error of the filter and of the encoders [m], claimed variance [m^2], NEES; (k, 5)."""
    truth, joints = dict[int, Array](), dict[int, Array]()
    for sample in log.samples(began_ns):
        if isinstance(sample, Truth):
            truth[sample.t_ns] = sample.nose_m
        elif isinstance(sample, JointState):
            joints[sample.t_ns] = sample.q
    rows = []
    for t, p, cov in log.noses:
        if t in truth and t in joints:
            error, dead = p - truth[t], arm.nose(joints[t]) - truth[t]
            rows.append((seconds(t - began_ns), np.linalg.norm(error), np.linalg.norm(dead), np.trace(cov), nees(error, cov)))
    return np.array(rows, dtype=np.float64).reshape(-1, 5)


def nose_error_at(found: Array, after_s: float, window_s: float) -> NoseErrorSample | None:
    """Return the nose errors at one time; None if there is no believed nose in the window."""
    rows = found[(found[:, 0] > after_s - window_s) & (found[:, 0] <= after_s)]
    if not len(rows):
        return None
    nose, dead = 1e3 * np.sqrt(np.mean(np.square(rows[:, 1:3]), axis=0))
    inside = float(np.mean(rows[:, 4] <= chdtri(3, 1.0 - COVERAGE)))
    return NoseErrorSample(after_s, float(nose), float(dead), 1e3 * float(np.sqrt(np.mean(rows[:, 3]))), inside)
