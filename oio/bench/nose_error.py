"""Where the nose was, where the filter had it and where the encoders had it, at the instants at which it sniffed."""

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtri

from oio.core.records import Array, JointState, Truth, seconds
from oio.inference.metrics import COVERAGE, nees
from oio.kinematics.arm import Arm
from oio.log import MemoryLog


class NoseLog(MemoryLog):
    """A log in memory that keeps believed noses as well."""

    def __init__(self) -> None:
        super().__init__()
        self.noses: list[tuple[int, Array, Array]] = []

    def odometry(self, t_ns: int, nose_m: Array, cov: Array) -> None:
        """Where the nose is believed to be."""
        self.noses.append((t_ns, np.array(nose_m), np.array(cov)))


@dataclass(frozen=True)
class Off:
    """Some seconds before `after_s`: RMS errors and RMS claimed standard deviation in mm, share of instants inside the 95 % region."""

    after_s: float
    nose_mm: float
    dead_reckoning_mm: float
    claimed_mm: float
    inside_95: float


def errors(log: NoseLog, arm: Arm, began_ns: int) -> Array:
    """Per instant: seconds since it began, error of the filter and of the encoders [m], claimed variance [m^2], NEES. (k, 5)."""
    truth, joints = dict[int, Array](), dict[int, Array]()
    for sample in log.samples(began_ns):
        if isinstance(sample, Truth):
            truth[sample.t_ns] = sample.nose_m
        elif isinstance(sample, JointState):
            joints[sample.t_ns] = sample.q
    rows = []
    for t, p, cov in log.noses:
        if t in truth and t in joints:
            miss, dead = p - truth[t], arm.nose(joints[t]) - truth[t]
            rows.append((seconds(t - began_ns), np.linalg.norm(miss), np.linalg.norm(dead), np.trace(cov), nees(miss, cov)))
    return np.array(rows, dtype=np.float64).reshape(-1, 5)


def off(found: Array, after_s: float, window_s: float) -> Off | None:
    """The figures of one time; None if the nose was nowhere believed to be then."""
    rows = found[(found[:, 0] > after_s - window_s) & (found[:, 0] <= after_s)]
    if not len(rows):
        return None
    nose, dead = 1e3 * np.sqrt(np.mean(np.square(rows[:, 1:3]), axis=0))
    inside = float(np.mean(rows[:, 4] <= chdtri(3, 1.0 - COVERAGE)))
    return Off(after_s, float(nose), float(dead), 1e3 * float(np.sqrt(np.mean(rows[:, 3]))), inside)
