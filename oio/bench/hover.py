"""Stage of `drift` with a known source: the arm sniffs about the beacon for a fixed time while the filter estimates the nose."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from oio.core.interfaces import Sensor
from oio.core.records import Array, JointState, seconds
from oio.estimators.base import Estimator, Initializer
from oio.estimators.odometry import Odometry, begin_from_best
from oio.inference.base import Localizer
from oio.kinematics.arm import Arm
from oio.results.calibration import Calibration, MapCalibration
from oio.runtime.context import Context, sniff

CERTAIN = 10**9  # measurements: makes the Type B variance of a known source negligible


@dataclass(frozen=True)
class Hovered:
    """Result of `Hover`: when it began."""

    began_ns: int


@dataclass(frozen=True)
class Hover:
    """Hover stage: the filter starts from the batch fit of the beacon, at a position known to `beacon_u_m`, and runs on."""

    needs: ClassVar[tuple[type, ...]] = (Calibration, MapCalibration)
    sensor: Sensor
    arm: Arm
    ekf: Estimator
    belief_map: Localizer
    place: Array  # (3,) m, of the beacon
    approach_m: float
    distances_m: tuple[float, ...]
    dwell_s: float
    for_s: float

    def run(self, context: Context) -> Hovered:
        """Run the stage; every believed nose is logged."""
        odometry, began_ns = self._initialised_odometry(context), context.world.t_ns
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

    def _initialised_odometry(self, context: Context) -> Odometry:
        odometry = Odometry(self.ekf, context.need(Calibration).chosen, self.belief_map)
        begin = self.ekf.begin if isinstance(self.ekf, Initializer) else begin_from_best
        prior, fit = odometry.prior, context.need(MapCalibration).fit
        widened = replace(fit, cov=prior.model.noise.inflation * fit.cov)  # inflated as in a search
        odometry.belief = begin(prior.model, (widened,), context.world.t_ns, CERTAIN)
        return odometry

    def _goal(self, context: Context, odometry: Odometry) -> Array:
        """Joint goal (n,) rad in encoder coordinates (offsets added) that puts the nose at one of the distances from the beacon.

        Where none is found the arm stays: a drift trial scores the nose wherever it is, and takes no reading for one at a distance.
        """
        assert odometry.belief is not None
        offset, commanded = odometry.belief.mean[odometry.prior.model.at["o"]], context.world.goal
        estimated_q = commanded - offset
        for _ in range(200):
            direction, distance_m = context.rng.standard_normal(3), context.rng.choice(self.distances_m)
            pose = self.arm.solve_ik(self.place + distance_m * direction / np.linalg.norm(direction), estimated_q)
            if pose is None or not self.arm.is_allowed(pose + offset) or not self.arm.path_is_free(commanded, pose + offset):
                continue
            if self.arm.clearance_m(estimated_q, pose, self.place) >= min(self.approach_m, 0.9 * distance_m):
                return pose + offset
        return commanded
