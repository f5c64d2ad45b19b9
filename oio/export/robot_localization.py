"""Parameters of ROS 2's robot_localization (ekf_node) that fuse the nose odometry of a run, `/estimate/odom`.

Format and order of the 15 states as in its params/ekf.yaml: x y z, roll pitch yaw, their rates, accelerations; matrices row by row.
Its filter adds process_noise_covariance times the time step (src/ekf.cpp), so that the matrix is per second. Only the position is
measured: the rest keeps a variance near zero, and velocity is a random walk whose density is that of the motion in the log.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from oio.core.errors import BadInput
from oio.core.records import Array
from oio.export.run_record import DEAD_RECKONING, ESTIMATE, RunRecord, rate_hz, refuse_fewer_than_two, stamps_s
from oio.export.yaml_number import yaml_number
from oio.figures.track import TrackOverTime

STATES = 15  # x y z roll pitch yaw vx vy vz vroll vpitch vyaw ax ay az
POSITION, VELOCITY = slice(0, 3), slice(6, 9)
UNUSED = 1e-9  # variance, as robot_localization's own initial value, and its smallest of a measurement
TEXT = """\
# OIO: nose odometry of {title}
# for robot_localization of ROS 2:  ros2 run robot_localization ekf_node --ros-args --params-file ekf.yaml
# SI units. A bridge has to publish /estimate/odom as nav_msgs/Odometry: header.frame_id base, child_frame_id nose, and the 6 x 6
# pose.covariance row by row (x y z roll pitch yaw) as it is in the log, whose zeros mean that the rotation is unknown; it is not fused.
# The odometry is an estimate already: its error stays nearly the same from message to message, while robot_localization takes errors as
# independent. Its covariance is therefore too small; that of the odometry is the one to believe.
ekf_filter_node:
  ros__parameters:
    frequency: {rate}  # Hz, the median rate of gas samples: /estimate/odom follows each; more only extrapolates between them
    sensor_timeout: {timeout}  # s, two periods
    two_d_mode: false
    publish_tf: false  # /tf of the log has base -> nose already
    odom_frame: base  # fixed; there is no map_frame
    world_frame: base
    base_link_frame: nose
    odom0: /estimate/odom
    odom0_config: [true,  true,  true,
                   false, false, false,
                   false, false, false,
                   false, false, false,
                   false, false, false]
    odom0_queue_size: 10
    odom0_differential: false
    odom0_relative: false
    # per second; velocity: (m/s)^2/s of the nose in this log
    process_noise_covariance: {noise}
    # position: the first odometry of the log, m^2; velocity: mean square of the log, (m/s)^2
    initial_estimate_covariance: {initial}
"""


def write_robot_localization(run: RunRecord, folder: Path) -> list[Path]:
    """Write ekf.yaml; returns its path. Raises BadInput where the log holds no odometry, or no motion of the nose."""
    odometry, motion = run.noses[ESTIMATE], run.noses[DEAD_RECKONING]
    if not len(odometry):
        raise BadInput(
            f"{run.log} holds no odometry (/estimate/odom): it begins with the first map of a search. Give a run that got so far."
        )
    rate = rate_hz(stamps_s(run.samples), "gas samples", run.log)
    refuse_fewer_than_two(motion.t_s, "joint states with a model of the arm", run.log)
    density, square = velocity_walk(motion, 1.0 / rate)
    noise, initial = np.diag(np.full(STATES, UNUSED)), np.diag(np.full(STATES, UNUSED))
    noise[VELOCITY, VELOCITY] = np.diag(np.maximum(density, UNUSED))
    initial[POSITION, POSITION] = (odometry.cov_m2[0] + odometry.cov_m2[0].T) / 2.0  # symmetric to the last bit
    initial[VELOCITY, VELOCITY] = np.diag(np.maximum(square, UNUSED))
    rates = {"rate": yaml_number(rate), "timeout": yaml_number(2.0 / rate)}
    text = TEXT.format(title=run.title, **rates, noise=_rows(noise), initial=_rows(initial))
    (folder / "ekf.yaml").write_text(text, encoding="utf-8")
    return [folder / "ekf.yaml"]


def velocity_walk(motion: TrackOverTime, step_s: float) -> tuple[Array, Array]:
    """Return the density (3,) (m/s)^2/s of the random walk of the velocity at steps of step_s, and its mean square (3,) (m/s)^2.

    The second difference over h of an integrated random walk of density q has variance 2/3 q h^3 (a squared triangle's integral).
    """
    count = max(int((motion.t_s[-1] - motion.t_s[0]) / step_s), 2)
    t_s = np.linspace(motion.t_s[0], motion.t_s[-1], count + 1)
    h, p = t_s[1] - t_s[0], np.stack([np.interp(t_s, motion.t_s, motion.p_m[:, i]) for i in range(3)], axis=1)
    second, first = np.diff(p, 2, axis=0), np.diff(p, axis=0) / h
    return np.mean(second**2, axis=0) / (2.0 / 3.0 * h**3), np.mean(first**2, axis=0)


def _rows(matrix: Array) -> str:
    """A matrix as one list of numbers, a row per line."""
    rows: Sequence[Sequence[float]] = matrix.tolist()
    return f"[{(',' + chr(10) + ' ' * 6).join(', '.join(map(yaml_number, row)) for row in rows)}]"
