"""Kinematic chain of an arm from its model file, MJCF or URDF, through MuJoCo's own compiler.

Whatever MuJoCo compiles is read as MuJoCo means it: default classes, includes, degrees, `ref`, joints off their body's origin, several
joints in one body, sliding joints, every way to write an orientation. Geometry is left out, so no mesh has to be there.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from oio.core.errors import BadInput
from oio.core.records import Array
from oio.kinematics.forward import HINGE, SLIDE
from oio.kinematics.model_loading import compile_kinematics


@dataclass(frozen=True)
class NosePoint:
    """Where the nose is in a model: a site, or a point offset_m (3,) m in the frame of a body (the only way in a URDF)."""

    site: str = "nose"
    body: str | None = None
    offset_m: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class KinematicChain:
    """m joints from the world to the nose: names, poses (m, 4, 4), axes (m, 3), kinds (m,), limits (m,), nose_offset (3,); nose_rotation
    (3, 3) from the frame of the nose to that of the last joint."""

    names: tuple[str, ...]
    poses: Array
    axes: Array
    kinds: NDArray[np.int64]
    low: Array
    high: Array
    nose_offset: Array
    nose_rotation: Array


def load_chain(path: Path, nose: NosePoint | None = None) -> KinematicChain:
    """The joints that move the nose, in their order from the base.

    Raises BadInput if MuJoCo does not compile the file, if the nose is not in it or no joint moves it, for ball and free joints, and for
    joints that follow another one.
    """
    nose, model = nose or NosePoint(), compile_kinematics(path)
    body, at_nose = _nose(model, nose, path)
    pose, poses, joints = np.eye(4), list[Array](), list[int]()
    for b in _from_world(model, body):
        pose = pose @ _transform(model.body_pos[b], model.body_quat[b])
        for j in range(model.body_jntadr[b], model.body_jntadr[b] + model.body_jntnum[b]):
            _refuse_joint(model, j, path)
            poses.append(_at_joint(model, j, pose))
            joints.append(j)
            pose = _translation(-model.jnt_pos[j])
    if not joints:
        raise BadInput(f"{path} has its nose on a body that no joint moves. Put it on the last moving body.")
    _refuse_coupled(model, joints, path)
    ranges = np.array([_range(model, j, path) for j in joints])
    return KinematicChain(
        names=tuple(model.joint(j).name for j in joints),
        poses=np.array(poses),
        axes=np.array([model.jnt_axis[j] for j in joints]),
        kinds=np.array([SLIDE if _is_slide(model, j) else HINGE for j in joints]),
        low=ranges[:, 0],
        high=ranges[:, 1],
        nose_offset=(pose @ np.append(at_nose[:3, 3], 1.0))[:3],
        nose_rotation=pose[:3, :3] @ at_nose[:3, :3],
    )


def _nose(model: Any, nose: NosePoint, path: Path) -> tuple[int, Array]:
    """The body that carries the nose, and the pose of the nose on it (4, 4)."""
    import mujoco

    if nose.body is not None:
        body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, nose.body)
        if body < 0:
            there = ", ".join(filter(None, (model.body(i).name for i in range(1, model.nbody))))
            raise BadInput(f"arm.nose_body={nose.body} was given, but the bodies of {path} are {there}. Type one of them.")
        return int(body), _translation(np.array(nose.offset_m))
    site = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, nose.site)
    if site < 0:
        there = ", ".join(filter(None, (model.site(i).name for i in range(model.nsite)))) or "none"
        raise BadInput(
            f'{path} has no site named \'{nose.site}\' (sites: {there}). Add <site name="{nose.site}" pos="..."/> where the sensor sits, '
            f"type arm.nose_site=NAME, or name a body: arm.nose_body=NAME arm.nose_offset_m=[x,y,z]."
        )
    return int(model.site_bodyid[site]), _transform(model.site_pos[site], model.site_quat[site])


def _from_world(model: Any, body: int) -> Iterator[int]:
    """Bodies from the first below the world to `body`."""
    if body > 0:
        yield from _from_world(model, int(model.body_parentid[body]))
        yield body


def _at_joint(model: Any, j: int, pose: Array) -> Array:
    """The frame (4, 4) in which joint j turns or slides, so that its angle is 0 where the model has it at 0, not at its `ref`."""
    if np.any(model.jnt_pos[j]):
        pose = pose @ _translation(model.jnt_pos[j])
    ref = float(model.qpos0[model.jnt_qposadr[j]])
    if ref == 0.0:
        return pose
    if _is_slide(model, j):
        return pose @ _translation(-ref * model.jnt_axis[j])
    return pose @ _transform(np.zeros(3), np.array([math.cos(0.5 * ref), *(-math.sin(0.5 * ref) * model.jnt_axis[j])]))


def _is_slide(model: Any, j: int) -> bool:
    import mujoco

    return bool(model.jnt_type[j] == mujoco.mjtJoint.mjJNT_SLIDE)


def _refuse_joint(model: Any, j: int, path: Path) -> None:
    import mujoco

    kind = mujoco.mjtJoint(model.jnt_type[j])
    if kind not in (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE):
        name = kind.name.removeprefix("mjJNT_").lower()
        raise BadInput(f"{path} moves its nose by the {name} joint '{model.joint(j).name}', but a joint can be a hinge or a slide.")


def _refuse_coupled(model: Any, joints: list[int], path: Path) -> None:
    """Refuse a joint of the chain that follows another one (URDF mimic): every joint is planned, and drifts, by itself."""
    import mujoco

    of_joints = np.flatnonzero((model.eq_type == mujoco.mjtEq.mjEQ_JOINT) & (model.eq_active0 != 0))
    pairs = [[int(ids[i]) for ids in (model.eq_obj1id, model.eq_obj2id) if ids[i] >= 0] for i in of_joints]
    for pair in pairs:
        if held := [model.joint(j).name for j in pair if j in joints]:
            others = " and ".join(f"'{model.joint(j).name}'" for j in pair)
            raise BadInput(
                f"{path} couples its joints {others} (equality in an MJCF, mimic in a URDF), but '{held[0]}' moves the nose, and every "
                f"joint of an arm moves by itself. Remove the coupling if the joints have motors of their own, or make one of them fixed."
            )


def _range(model: Any, j: int, path: Path) -> tuple[float, float]:
    """Limits in rad or m; a hinge without limits may turn once around."""
    if model.jnt_limited[j]:
        return float(model.jnt_range[j, 0]), float(model.jnt_range[j, 1])
    if _is_slide(model, j):
        raise BadInput(f"{path} has the sliding joint '{model.joint(j).name}' without limits. Give it a range in metres.")
    return -math.pi, math.pi


def _translation(p: Array) -> Array:
    pose = np.eye(4)
    pose[:3, 3] = p
    return pose


def _transform(p: Array, quat: Array) -> Array:
    """Pose (4, 4) of a position (3,) m and a unit quaternion (4,) w, x, y, z."""
    w, x, y, z = quat
    pose = np.eye(4)
    pose[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    pose[:3, 3] = p
    return pose
