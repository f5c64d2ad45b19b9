"""A path and readings on it as one stream in time order, as a live world would give them."""

from collections.abc import Iterator

import numpy as np

from oio.api.samples import JointPath
from oio.core.errors import BadInput
from oio.core.records import GasReading, JointState
from oio.estimators.odometry import Odometry
from oio.kinematics.finite_differences import FiniteDifferences
from oio.tabular.positions import holes, outside

ROUNDING_S = np.array([1e-6, -1e-6])  # at the ends of a hole


def stream(poses: JointPath, readings: list[GasReading]) -> Iterator[JointState | GasReading]:
    """Yield joint states and readings, joints first where both have one time; the path is interpolated at the readings.

    Raises BadInput if there are no readings, or some outside the path.
    """
    stamps = _inside(poses, readings)
    _refuse_holes(poses, stamps)
    nodes, q = poses.at(stamps)
    ends, differences = np.searchsorted(stamps, nodes, side="right"), FiniteDifferences()
    done = 0
    for t_ns, here, end in zip(nodes.tolist(), q, ends.tolist(), strict=True):
        yield differences.state(int(t_ns), here)
        yield from readings[done:end]
        done = end


def fed(odometry: Odometry, poses: JointPath, readings: list[GasReading]) -> None:
    """Feed all of it to an odometry."""
    for sensed in stream(poses, readings):
        if isinstance(sensed, JointState):
            odometry.joints(sensed)
        else:
            odometry.reading(sensed)


def _refuse_holes(poses: JointPath, stamps: np.ndarray) -> None:
    """Refuse readings where nobody knows the way of the nose."""
    missing = holes(np.asarray(poses.t_s), np.asarray(poses.q)) + ROUNDING_S
    lost_s = 1e-9 * stamps[~outside(1e-9 * stamps, missing)]
    if len(lost_s):
        begin, end = next((begin, end) for begin, end in missing if begin < lost_s[0] < end)
        raise BadInput(
            f"the poses have a hole from {begin:g} to {end:g} s, after which the nose is elsewhere, and {len(lost_s)} readings are in such "
            f"holes. Leave these out: readings.only((readings.t_s <= {begin:g}) | (readings.t_s >= {end:g}))."
        )


def _inside(poses: JointPath, readings: list[GasReading]) -> np.ndarray:
    if not readings:
        raise BadInput("all readings are at the upper end of the sensor's scale, but at least two must be measurements. Give others.")
    stamps = np.array([reading.t_ns for reading in readings], dtype=np.float64)
    begin, end = (float(np.rint(np.asarray(poses.t_s)[i] * 1e9)) for i in (0, -1))
    if stamps[0] < begin or stamps[-1] > end:
        raise BadInput(
            f"the readings run from {stamps[0] / 1e9:g} to {stamps[-1] / 1e9:g} s, but the poses from {begin / 1e9:g} to {end / 1e9:g} s. "
            f"Give poses for all readings, or cut the readings: readings.between({begin / 1e9:g}, {end / 1e9:g})."
        )
    return stamps
