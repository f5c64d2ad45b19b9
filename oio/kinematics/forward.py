"""Forward kinematics of a serial chain with its Jacobian, compiled: one pose costs about a microsecond."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from oio.core.compiled import compiled
from oio.core.records import Array

SLIDE, HINGE = 0, 1


class SerialChain(NamedTuple):
    """m joints from the base to the nose, T = prod_j pose_j motion_j(q_j), one joint per link."""

    poses: Array  # (m, 4, 4), of each joint's frame in the frame before
    axes: Array  # (m, 3), in the joint's frame
    kinds: NDArray[np.int64]  # (m,), SLIDE or HINGE
    locked: Array  # (m,) rad or m, where joints stay that are not moved
    offset: Array  # (3,) m, the nose in the last frame


@compiled
def nose_and_jacobian(q: Array, chain: SerialChain, want_jacobian: bool = True) -> tuple[Array, Array]:
    """Nose positions (k, 3) m and, if wanted, Jacobians (k, 3, n) for joints q (k, n); joints n..m-1 of the chain stay locked.

    Column j of the Jacobian is axis_j x (p - anchor_j) for a hinge and axis_j for a slide, in the base frame.
    """
    poses, axes, kinds, locked, offset = chain
    k, n = q.shape
    m = poses.shape[0]
    p_all, j_all = np.empty((k, 3)), np.empty((k, 3, n if want_jacobian else 0))
    anchors, directions = np.empty((m, 3)), np.empty((m, 3))
    rotation, turned, turn = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    position = np.empty(3)
    for i in range(k):
        rotation[:] = 0.0
        rotation[0, 0] = rotation[1, 1] = rotation[2, 2] = 1.0
        position[:] = 0.0
        for j in range(m):
            _advance(rotation, position, poses[j, :3, 3])
            _multiply(rotation, poses[j, :3, :3], turned)
            _copy(turned, rotation)
            for a in range(3):
                directions[j, a] = rotation[a, 0] * axes[j, 0] + rotation[a, 1] * axes[j, 1] + rotation[a, 2] * axes[j, 2]
                anchors[j, a] = position[a]
            value = q[i, j] if j < n else locked[j]
            if kinds[j] == SLIDE:
                for a in range(3):
                    position[a] += directions[j, a] * value
            else:
                _rodrigues(axes[j], value, turn)
                _multiply(rotation, turn, turned)
                _copy(turned, rotation)
        _advance(rotation, position, offset)
        for a in range(3):
            p_all[i, a] = position[a]
        for j in range(n if want_jacobian else 0):
            if kinds[j] == SLIDE:
                for a in range(3):
                    j_all[i, a, j] = directions[j, a]
                continue
            for a in range(3):
                b, c = (a + 1) % 3, (a + 2) % 3
                j_all[i, a, j] = directions[j, b] * (position[c] - anchors[j, c]) - directions[j, c] * (position[b] - anchors[j, b])
    return p_all, j_all


@compiled
def _advance(rotation: Array, position: Array, step: Array) -> None:  # position += rotation @ step
    for a in range(3):
        position[a] += rotation[a, 0] * step[0] + rotation[a, 1] * step[1] + rotation[a, 2] * step[2]


@compiled
def _multiply(a: Array, b: Array, out: Array) -> None:  # out = a @ b, (3, 3)
    for i in range(3):
        for j in range(3):
            out[i, j] = a[i, 0] * b[0, j] + a[i, 1] * b[1, j] + a[i, 2] * b[2, j]


@compiled
def _copy(a: Array, out: Array) -> None:  # out[:] = a would compile the words of an error for seconds
    for i in range(3):
        for j in range(3):
            out[i, j] = a[i, j]


@compiled
def _rodrigues(axis: Array, angle: float, out: Array) -> None:  # R = cos I + sin [w] + (1 - cos) w w'
    s, c = np.sin(angle), np.cos(angle)
    x, y, z = axis[0], axis[1], axis[2]
    t = 1.0 - c
    out[0, 0], out[0, 1], out[0, 2] = c + t * x * x, t * x * y - s * z, t * x * z + s * y
    out[1, 0], out[1, 1], out[1, 2] = t * x * y + s * z, c + t * y * y, t * y * z - s * x
    out[2, 0], out[2, 1], out[2, 2] = t * x * z - s * y, t * y * z + s * x, c + t * z * z
