"""The arm in a viewer: its frames as transforms, and the shapes of links, box and beacon, drawn once in those frames."""

from itertools import pairwise
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.CylinderPrimitive_pb2 import CylinderPrimitive
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from foxglove_schemas_protobuf.Point3_pb2 import Point3
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3

from oio.core.quaternions import quaternion
from oio.core.records import Array
from oio.log.encode import pose, stamp
from oio.log.entries import ArmFrames, Setup
from oio.log.scene import ball, point

STEPS = 2**16  # of a quaternion's number in the log: 1e-5, so that its bytes compress
RADIUS_M, BALL_M = 0.012, 0.03  # of what is drawn
ARM, BOX, BEACON, SOURCE = (
    Color(r=r, g=g, b=b, a=a) for r, g, b, a in ((0.85, 0.72, 0.2, 1), (0.6, 0.6, 0.6, 0.4), (0.1, 0.6, 0.3, 0.8), (0.9, 0, 0, 1))
)
CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
EDGES = [(a, b) for a in range(8) for b in range(a + 1, 8) if np.sum(CORNERS[a] != CORNERS[b]) == 1]


def frame_names(links: int) -> list[str]:
    """Names of the frames of an arm of so many links: base, link1, ..., nose."""
    return ["base", *(f"link{i + 1}" for i in range(links)), "nose"]


def transforms(frames: ArmFrames) -> FrameTransforms:
    """Encode the frames of the arm; rotations are rounded to what a viewer can show."""
    at, names = stamp(frames.t_ns), frame_names(len(frames.places_m) - 1)
    turns = np.round(frames.turns * STEPS) / STEPS
    rows = zip(pairwise(names), frames.places_m.tolist(), turns.tolist(), strict=True)
    return FrameTransforms(transforms=[_transform(at, *row) for row in rows])


def _transform(at: dict[str, int], frames: tuple[str, str], p_m: list[float], xyzw: list[float]) -> FrameTransform:
    (parent, child), (x, y, z), (qx, qy, qz, qw) = frames, p_m, xyzw
    return FrameTransform(
        timestamp=at, parent_frame_id=parent, child_frame_id=child, translation=Vector3(x=x, y=y, z=z),
        rotation=Quaternion(x=qx, y=qy, z=qz, w=qw),
    )  # fmt: skip


def arm_frames(t_ns: int, data: bytes) -> ArmFrames:
    """Decode the frames of the arm."""
    sent = FrameTransforms.FromString(data).transforms
    places = [(f.translation.x, f.translation.y, f.translation.z) for f in sent]
    return ArmFrames(t_ns, np.array(places), np.array([(f.rotation.x, f.rotation.y, f.rotation.z, f.rotation.w) for f in sent]))


def setup_scene(t_ns: int, setup: Setup) -> SceneUpdate:
    """Encode what stands still: in every frame the link that ends where the next begins, the box of the nose, the beacon."""
    names = frame_names(len(setup.steps_m) - 1)
    links = [
        _entity(t_ns, f"link {name}", name, cylinders=_cylinders(step), spheres=[ball(np.zeros(3), 2 * RADIUS_M, ARM)])
        for name, step in zip(names[:-1], setup.steps_m, strict=True)
    ]
    rails = [_entity(t_ns, f"rail {j}", names[j], lines=[_lines([a, b], ARM)]) for j, a, b in setup.rails]
    box = _entity(t_ns, "box", "base", lines=[_box(setup.box_m)])
    beacon = [] if setup.beacon_m is None else [_entity(t_ns, "beacon", "base", spheres=[ball(setup.beacon_m, BALL_M, BEACON)])]
    return SceneUpdate(entities=[*links, *rails, box, *beacon])


def source_scene(t_ns: int, source_m: Array) -> SceneUpdate:
    """Encode the true source at (3,) m; NaN: there is none, and an earlier one disappears."""
    balls = [ball(source_m, BALL_M, SOURCE)] if np.all(np.isfinite(source_m)) else []
    return SceneUpdate(entities=[_entity(t_ns, "true source", "base", spheres=balls)])


def _entity(t_ns: int, name: str, frame: str, **primitives: Any) -> SceneEntity:
    return SceneEntity(timestamp=stamp(t_ns), frame_id=frame, id=name, frame_locked=True, **primitives)  # locked: it moves with its frame


def _cylinders(step_m: Array) -> list[CylinderPrimitive]:
    """A link from the origin to step_m (3,) m, if that is elsewhere; a cylinder stands along its own z."""
    length_m = float(np.linalg.norm(step_m))
    if length_m < 1e-6:
        return []
    turn = quaternion(_from_z(step_m / length_m))
    size = Vector3(x=2 * RADIUS_M, y=2 * RADIUS_M, z=length_m)
    return [CylinderPrimitive(pose=pose(0.5 * step_m, turn.tolist()), size=size, bottom_scale=1.0, top_scale=1.0, color=ARM)]


def _from_z(direction: Array) -> Array:
    """A rotation (3, 3) that takes z to a direction (3,)."""
    across = np.cross(direction, np.eye(3)[int(np.argmin(np.abs(direction)))])
    across /= np.linalg.norm(across)
    return np.column_stack([across, np.cross(direction, across), direction])


def _box(box_m: Array) -> LinePrimitive:
    corners = box_m[0] + CORNERS * (box_m[1] - box_m[0])
    return _lines([corners[i] for edge in EDGES for i in edge], BOX)


def _lines(ends_m: list[Array], color: Color) -> LinePrimitive:
    points = [Point3(x=x, y=y, z=z) for x, y, z in (end.tolist() for end in ends_m)]
    still = pose(np.zeros(3))
    return LinePrimitive(type=LinePrimitive.LINE_LIST, pose=still, thickness=2.0, scale_invariant=True, points=points, color=color)


def setup(data: bytes) -> Setup | None:
    """Decode what stands still, as it was passed to `setup_scene`; None for a scene of something else."""
    drawn = {entity.id: entity for entity in SceneUpdate.FromString(data).entities}
    if "box" not in drawn:
        return None
    links = [entity for name, entity in drawn.items() if name.startswith("link ")]
    names = frame_names(len(links) - 1)
    rails = [_rail(entity, names) for name, entity in drawn.items() if name.startswith("rail ")]
    corners = np.array(_points(drawn["box"].lines[0]))
    beacon = point(drawn["beacon"].spheres[0]) if "beacon" in drawn else None
    return Setup(np.array([_step(link) for link in links]), rails, np.array([corners.min(axis=0), corners.max(axis=0)]), beacon)


def _rail(entity: SceneEntity, names: list[str]) -> tuple[int, Array, Array]:
    start, end = _points(entity.lines[0])
    return names.index(entity.frame_id), start, end


def _step(link: SceneEntity) -> Array:
    return 2.0 * point(link.cylinders[0]) if link.cylinders else np.zeros(3)


def _points(line: LinePrimitive) -> list[Array]:
    return [np.array([p.x, p.y, p.z]) for p in line.points]
