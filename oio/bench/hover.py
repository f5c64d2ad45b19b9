"""The stage of `drift` with a known source: the arm sniffs about the beacon for as long as it is told, and the filter watches its nose."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from oio.core.interfaces import Sensor
from oio.core.records import Array, JointState, seconds
from oio.estimators.base import Estimator, Initializer
from oio.estimators.odometry import Odometry, begin_from_best
from oio.inference.belief_map import BeliefMap
from oio.kinematics.arm import Arm
from oio.results.calibration import Calibration, MapCalibration
from oio.runtime.context import Context, sniff

CERTAIN = 10**9  # measurements: none of Type B is left in the place of a source that is known


@dataclass(frozen=True)
class Hovered:
    """When it began."""

    began_ns: int


@dataclass(frozen=True)
class Hover:
    """Begins with the batch fit of the beacon, whose place is known to `beacon_u_m`, and goes on with the filter alone."""

    needs: ClassVar[tuple[type, ...]] = (Calibration, MapCalibration)
    sensor: Sensor
    arm: Arm
    ekf: Estimator
    belief_map: BeliefMap
    place: Array  # (3,) m, of the beacon
    approach_m: float
    distances_m: tuple[float, ...]
    dwell_s: float
    for_s: float

    def run(self, context: Context) -> Hovered:
        """Every believed nose goes to the log."""
        odometry, began_ns = self._begun(context), context.world.t_ns
        while seconds(context.world.t_ns - began_ns) < self.for_s:
            for sensed in sniff(context, self.sensor, self._goal(context, odometry), self.dwell_s):
                if isinstance(sensed, JointState):
                    odometry.joints(sensed)
                    continue
                odometry.reading(sensed)
                nose = odometry.nose()
                if nose is not None:
                    context.log.odometry(sensed.t_ns, *nose)
        return Hovered(began_ns)

    def _begun(self, context: Context) -> Odometry:
        odometry = Odometry(self.ekf, context.need(Calibration).chosen, self.belief_map)
        begin = self.ekf.begin if isinstance(self.ekf, Initializer) else begin_from_best
        known, fit = odometry.prior, context.need(MapCalibration).fit
        widened = replace(fit, cov=known.model.noise.inflation * fit.cov)  # as a search has it
        odometry.belief = begin(known.model, (widened,), context.world.t_ns, CERTAIN)
        return odometry

    def _goal(self, context: Context, odometry: Odometry) -> Array:
        """What to tell the servos (n,) rad, which believe their encoders, so that the nose stands some distance off the beacon."""
        assert odometry.belief is not None
        offset, told = odometry.belief.mean[odometry.prior.model.at["o"]], context.world.goal
        here = told - offset
        for _ in range(200):
            direction, distance_m = context.rng.standard_normal(3), context.rng.choice(self.distances_m)
            pose = self.arm.reach(self.place + distance_m * direction / np.linalg.norm(direction), here)
            if pose is None or not self.arm.inside(pose + offset) or not self.arm.free(told, pose + offset):
                continue
            if self.arm.clearance_m(here, pose, self.place) >= min(self.approach_m, 0.9 * distance_m):
                return pose + offset
        return told
