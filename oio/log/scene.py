"""Foxglove 3D scene of the belief: translucent range spheres, 95 % ellipsoids of the source hypotheses, one line of text."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from foxglove_schemas_protobuf.SpherePrimitive_pb2 import SpherePrimitive
from foxglove_schemas_protobuf.TextPrimitive_pb2 import TextPrimitive
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3

from oio.core.quaternions import quaternion, rotation
from oio.core.records import Array
from oio.log.encode import pose, stamp
from oio.log.entries import BeliefScene

CHI2_95 = 7.81  # 95 % quantile of chi-square with 3 degrees of freedom
_SPHERE_COLOR = Color(r=0.2, g=0.5, b=1.0, a=0.12)
_HYPOTHESIS_COLOR = Color(r=1.0, g=0.4, b=0.1, a=0.5)
_TEXT_COLOR = Color(r=1.0, g=1.0, b=1.0, a=1.0)
_TEXT_AT_M = np.array([0.0, 0.0, 0.6])  # above the arm


def scene(t_ns: int, centres_m: Array, radii_m: Array, hypotheses: Sequence[tuple[Array, Array]], text: str) -> SceneUpdate:
    """Return the scene: spheres at centres_m (k, 3) m of radii_m (k,) m, hypotheses of mean (3,) m and covariance (3, 3) m^2, frame base.

    Entries that are not finite cannot be drawn and are left out.
    """
    spheres = [_sphere(c, np.full(3, 2 * r), _SPHERE_COLOR) for c, r in zip(centres_m, radii_m, strict=True) if _finite(c, r)]
    ellipsoids = [_ellipsoid(mean, cov) for mean, cov in hypotheses if _finite(mean, cov)]
    label = TextPrimitive(pose=pose(_TEXT_AT_M), billboard=True, font_size=14.0, scale_invariant=True, color=_TEXT_COLOR, text=text)
    entities = [
        _entity(t_ns, "spheres", spheres=spheres),
        _entity(t_ns, "hypotheses", spheres=ellipsoids),
        _entity(t_ns, "text", texts=[label]),
    ]
    return SceneUpdate(entities=entities)  # an entity replaces the older one of the same id


def _entity(t_ns: int, name: str, **primitives: Any) -> SceneEntity:
    return SceneEntity(timestamp=stamp(t_ns), frame_id="base", id=name, **primitives)


def _ellipsoid(mean: Array, cov: Array) -> SpherePrimitive:
    variances, axes = np.linalg.eigh(cov)
    axes[:, 0] *= math.copysign(1.0, np.linalg.det(axes))  # eigenvectors may be a mirror, a rotation may not
    size_m = 2.0 * np.sqrt(CHI2_95 * np.maximum(variances, 0.0))
    return _sphere(mean, size_m, _HYPOTHESIS_COLOR, quaternion(axes).tolist())


def _sphere(centre_m: Array, size_m: Array, color: Color, xyzw: Sequence[float] = (0.0, 0.0, 0.0, 1.0)) -> SpherePrimitive:
    x, y, z = size_m.tolist()
    return SpherePrimitive(pose=pose(centre_m, xyzw), size=Vector3(x=x, y=y, z=z), color=color)


def ball(centre_m: Array, diameter_m: float, color: Color) -> SpherePrimitive:
    """Return a sphere at (3,) m."""
    return _sphere(centre_m, np.full(3, diameter_m), color)


def _finite(*arrays: Array | float) -> bool:
    return all(np.all(np.isfinite(array)) for array in arrays)


def belief_scene(t_ns: int, data: bytes) -> BeliefScene | None:
    """Decode a scene as it was passed to `scene`; None for one of something else."""
    drawn = {entity.id: entity for entity in SceneUpdate.FromString(data).entities}
    if "hypotheses" not in drawn:
        return None
    balls = [(point(ball), 0.5 * ball.size.x) for ball in drawn["spheres"].spheres]
    centres, radii = np.array([centre for centre, _ in balls]).reshape(-1, 3), np.array([radius for _, radius in balls])
    told = [text.text for text in drawn["text"].texts]
    return BeliefScene(t_ns, centres, radii, [_mean_and_cov(ball) for ball in drawn["hypotheses"].spheres], " ".join(told))


def point(drawn: Any) -> Array:
    """Return the place (3,) m of a primitive."""
    p = drawn.pose.position
    return np.array([p.x, p.y, p.z])


def _mean_and_cov(drawn: Any) -> tuple[Array, Array]:
    q, size = drawn.pose.orientation, drawn.size
    axes = rotation(np.array([q.x, q.y, q.z, q.w]))
    variances = np.array([size.x, size.y, size.z]) ** 2 / (4.0 * CHI2_95)
    return point(drawn), axes * variances @ axes.T
