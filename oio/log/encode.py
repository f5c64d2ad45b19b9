"""Encoder: records to messages, with topic and schema, bit for bit."""

import functools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.JointState_pb2 import JointState as FoxgloveJoint
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.Odometry_pb2 import Odometry
from foxglove_schemas_protobuf.Pose_pb2 import Pose
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3

from oio.core.records import (
    SECOND_NS,
    Array,
    Belief,
    Event,
    FilterEstimate,
    GasReading,
    GasSample,
    Innovation,
    JointState,
    Truth,
    WorldSample,
)
from oio.log import schemas

Topics = dict[str, Any]  # the messages of one record, by topic
JOINTS, TRUTH, EVENTS = "/arm/joint_states", "/truth/state", "/events"


def gas_topic(sensor: str) -> str:
    """Return the topic of a sensor's raw samples."""
    return f"/gas/{sensor}/sample"


def sample_topics(sensor: str) -> dict[str, Any]:
    """Return the topics of world samples, with the class of message on each."""
    return {JOINTS: JointStates, gas_topic(sensor): schemas.GasSample, TRUTH: schemas.TruthState, EVENTS: schemas.Event}


def stamp(t_ns: int) -> dict[str, int]:
    """Return a protobuf Timestamp, from the moment the world opened; the file moves it to the time of day, if there is one."""
    seconds, nanos = divmod(t_ns, SECOND_NS)
    return {"seconds": seconds, "nanos": nanos}


def world_sample(sample: WorldSample, sensor: str, joints: Sequence[str]) -> Topics:
    """Encode a world sample; raises ValueError if there are not as many joint values as names."""
    match sample:
        case JointState():
            return {JOINTS: _joint_states(sample, joints)}
        case GasSample():
            return {gas_topic(sensor): _gas_sample(sample)}
        case Truth():
            known = np.isfinite(sample.nose_m).all()  # a bench may know its source, never where its nose truly is
            return {TRUTH: _truth_state(sample), **({"/truth/nose": _truth_nose(sample)} if known else {})}
        case Event(kind="span" | "guard"):
            return {EVENTS: _event(sample)}  # used by `backend=replay` only, spans several a second: not shown in the viewer's log
        case Event():
            return {EVENTS: _event(sample), "/log": _log_line(sample)}


def _joint_states(state: JointState, joints: Sequence[str]) -> Any:
    rows = zip(joints, state.q.tolist(), state.dq.tolist(), state.ddq.tolist(), strict=True)
    moving = [FoxgloveJoint(name=name, position=q, velocity=dq, acceleration=ddq) for name, q, dq, ddq in rows]
    return JointStates(timestamp=stamp(state.t_ns), joints=moving)


def _gas_sample(sample: GasSample) -> Any:
    return schemas.GasSample(stamp=stamp(sample.t_ns), frame_id="nose", element=sample.element, raw=sample.raw)


def _truth_state(truth: Truth) -> Any:
    q, nose_m, source_m = truth.q.tolist(), truth.nose_m.tolist(), truth.source_m.tolist()
    return schemas.TruthState(stamp=stamp(truth.t_ns), q=q, nose_m=nose_m, source_m=source_m, ppm=truth.ppm)


def _truth_nose(truth: Truth) -> Any:
    return PoseInFrame(timestamp=stamp(truth.t_ns), frame_id="base", pose=pose(truth.nose_m))


def _event(event: Event) -> Any:
    return schemas.Event(stamp=stamp(event.t_ns), kind=event.kind, text=event.text)


def _log_line(event: Event) -> Any:
    return Log(timestamp=stamp(event.t_ns), level=Log.INFO, name=event.kind, message=event.text)


def pose(p_m: Array, xyzw: Sequence[float] = (0.0, 0.0, 0.0, 1.0)) -> Pose:
    """Return a pose at p_m (3,) m, unrotated unless a quaternion is given."""
    x, y, z, w = xyzw
    return Pose(position=_vector(p_m), orientation=Quaternion(x=x, y=y, z=z, w=w))


def _vector(p_m: Array) -> Vector3:
    x, y, z = p_m.tolist()
    return Vector3(x=x, y=y, z=z)


def gas_reading(reading: GasReading) -> Any:
    """Encode one calibrated reading."""
    return schemas.GasReading(stamp=stamp(reading.t_ns), element=reading.element, ppm=reading.ppm, sigma_ppm=reading.sigma_ppm)


def state(belief: Belief, names: Sequence[str], units: Sequence[str]) -> Any:
    """Encode a belief; only the upper triangle of the covariance is stored, so it should be symmetric to the last bit."""
    n = len(belief.mean)
    if not len(names) == len(units) == n:
        raise ValueError(f"a belief of {n} entries has {len(names)} names and {len(units)} units")
    return schemas.State(stamp=stamp(belief.t_ns), names=names, units=units, mean=belief.mean.tolist(), cov_upper=_upper(belief.cov))


def _upper(cov: Array) -> list[float]:
    return list(cov[_upper_indices(len(cov))].tolist())


@functools.cache
def _upper_indices(n: int) -> tuple[Any, Any]:
    return np.triu_indices(n)


def filter_estimate(one: FilterEstimate) -> Topics:
    """Encode what a filter that was run over the log estimated; a topic per variant."""
    message = schemas.FilterEstimate(
        stamp=stamp(one.t_ns), variant=one.variant, nose_m=one.nose_m.tolist(), nose_cov_upper=_upper(one.nose_cov),
        source_m=one.source_m.tolist(), source_cov_upper=_upper(one.source_cov),
    )  # fmt: skip
    return {f"/evaluate/{one.variant}": message}


def odometry(t_ns: int, nose_m: Array, cov: Array) -> Topics:
    """Encode the nose in the base frame, position (3,) m and covariance (3, 3) m^2; rotation is not estimated (zero is "unknown")."""
    full = np.zeros((6, 6))
    full[:3, :3] = cov
    at = stamp(t_ns)
    place = Odometry(timestamp=at, frame_id="base", body_frame_id="nose_believed", pose=pose(nose_m), pose_covariance=full.ravel().tolist())
    frame = FrameTransform(
        timestamp=at, parent_frame_id="base", child_frame_id="nose_believed", translation=_vector(nose_m), rotation=Quaternion(w=1.0)
    )
    return {"/estimate/odom": place, "/estimate/tf": frame}


def innovation(surprise: Innovation) -> Any:
    """Encode an innovation; `nis` is NaN if the covariance is singular, since logging must not stop a run."""
    try:
        nis = surprise.nis
    except np.linalg.LinAlgError:
        nis = math.nan
    residual, cov = surprise.residual.tolist(), surprise.cov.ravel().tolist()
    return schemas.Innovation(stamp=stamp(surprise.t_ns), residual=residual, cov=cov, nis=nis, gated=surprise.gated)


def stage_result(t_ns: int, stage: str, state: str, json: str) -> Any:
    """Encode a stage event: `begin`, `end` with the result, or `failed` with the error."""
    return schemas.StageResult(stamp=stamp(t_ns), stage=stage, state=state, json=json)
