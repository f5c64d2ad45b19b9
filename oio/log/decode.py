"""Decoder: messages to records, by the name of their schema; every float is preserved bit for bit."""

from collections.abc import Callable
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from foxglove_schemas_protobuf.Odometry_pb2 import Odometry

from oio.core.records import Array, Belief, Event, FilterEstimate, GasReading, GasSample, Innovation, JointState, Truth, WorldSample
from oio.log import schemas


def _joint_state(t_ns: int, data: bytes) -> JointState:
    joints = JointStates.FromString(data).joints
    rows = np.array([(j.position, j.velocity, j.acceleration) for j in joints], dtype=np.float64).reshape(-1, 3)
    return JointState(t_ns, *rows.T)


def _gas_sample(t_ns: int, data: bytes) -> GasSample:
    message = schemas.GasSample.FromString(data)
    return GasSample(t_ns, message.element, message.raw)


def _truth(t_ns: int, data: bytes) -> Truth:
    message = schemas.TruthState.FromString(data)
    return Truth(t_ns, np.array(message.q), np.array(message.nose_m), np.array(message.source_m), message.ppm)


def event(t_ns: int, data: bytes) -> Event:
    """Decode an event."""
    message = schemas.Event.FromString(data)
    return Event(t_ns, message.kind, message.text)


# A message's log time is the time of its record, so the stamp inside need not be read again.
SAMPLES: dict[str, Callable[[int, bytes], WorldSample]] = {
    "foxglove.JointStates": _joint_state,
    "oio.v1.GasSample": _gas_sample,
    "oio.v1.TruthState": _truth,
    "oio.v1.Event": event,
}


def belief(t_ns: int, data: bytes) -> Belief:
    """Decode a belief; its full covariance is rebuilt from the upper triangle."""
    message = schemas.State.FromString(data)
    return Belief(t_ns, np.array(message.mean), _mirrored(message.cov_upper, len(message.mean)))


def named_belief(t_ns: int, data: bytes) -> tuple[tuple[str, ...], Belief]:
    """Decode a belief with the names of its n entries."""
    return tuple(schemas.State.FromString(data).names), belief(t_ns, data)


def filter_estimate(t_ns: int, data: bytes) -> FilterEstimate:
    """Decode what a filter that was run over the log estimated."""
    m = schemas.FilterEstimate.FromString(data)
    nose_cov, source_cov = _mirrored(m.nose_cov_upper, 3), _mirrored(m.source_cov_upper, 3)
    return FilterEstimate(t_ns, m.variant, np.array(m.nose_m), nose_cov, np.array(m.source_m), source_cov)


def _mirrored(upper: Any, n: int) -> Array:
    cov = np.empty((n, n))
    cov[np.triu_indices(n)] = upper
    cov.T[np.triu_indices(n)] = upper
    return cov


def innovation(t_ns: int, data: bytes) -> Innovation:
    """Decode an innovation."""
    message = schemas.Innovation.FromString(data)
    m = len(message.residual)
    return Innovation(t_ns, np.array(message.residual), np.array(message.cov).reshape(m, m), message.gated)


def reading(t_ns: int, data: bytes) -> GasReading:
    """Decode a calibrated reading."""
    message = schemas.GasReading.FromString(data)
    return GasReading(t_ns, message.element, message.ppm, message.sigma_ppm)


def odometry(t_ns: int, data: bytes) -> tuple[int, Array, Array]:
    """Decode odometry: t_ns, believed nose position (3,) m, its covariance (3, 3) m^2."""
    message = Odometry.FromString(data)
    p = message.pose.position
    return t_ns, np.array([p.x, p.y, p.z]), np.array(message.pose_covariance).reshape(6, 6)[:3, :3]


def stage_json(data: bytes) -> str:
    """Decode the result in a stage event: JSON text."""
    return str(schemas.StageResult.FromString(data).json)


def stage(t_ns: int, data: bytes) -> tuple[int, str, str]:
    """Decode a stage event: t_ns, the stage, its state (`begin`, `end` or `failed`)."""
    message = schemas.StageResult.FromString(data)
    return t_ns, message.stage, message.state
