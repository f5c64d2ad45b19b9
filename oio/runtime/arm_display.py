"""The arm for viewers: what stands still once, and its frames while it moves."""

import numpy as np

from oio.core.records import Array, JointState, nanoseconds
from oio.kinematics.arm import Arm
from oio.kinematics.link_frames import LinkFrames
from oio.log import ArmFrames, RunLog, Setup

EVERY_S = 0.1  # of the world, between two poses of the arm in the log
STILL_RAD = 1e-3  # an arm whose joints have all moved less since then is not logged again: 0.4 mm at its nose


class ArmDisplay:
    """Logs the frames of the arm as its encoders have them, true or not: what the filter believes is elsewhere in the log."""

    def __init__(self, arm: Arm, log: RunLog) -> None:
        self._frames, self._log = LinkFrames(arm.chain), log
        self.begin()

    def begin(self) -> None:
        """Begin anew: the next joints are logged in any case. Every stage does, so that a run may go on from any of them."""
        self._due_ns, self._shown = 0, np.empty(0)

    def follow(self, joints: JointState) -> None:
        """Take up the joints; log the frames if it is time and the arm has moved."""
        if joints.t_ns < self._due_ns or (len(self._shown) and np.max(np.abs(joints.q - self._shown)) < STILL_RAD):
            return
        self._due_ns, self._shown = joints.t_ns + nanoseconds(EVERY_S), joints.q
        self._log.arm(ArmFrames(joints.t_ns, *self._frames.at(joints.q)))


def setup_of(arm: Arm, beacon_m: Array | None) -> Setup:
    """Return what stands still around an arm, the beacon at (3,) m with it."""
    frames = LinkFrames(arm.chain)
    return Setup(frames.steps_m, frames.rails(arm.model.low, arm.model.high), np.array([arm.box_low_m, arm.box_high_m]), beacon_m)
