"""The nose from the joints, and what a field's gradient at the nose is by the joints, link by link and without a Jacobian.

A link carries a point of the frame after it back by p_before = place + P (R(w, q) p + slide w q): R turns about w (Rodrigues' formula
R p = p cos + w x p sin + w (w.p) (1 - cos)), or is none if the joint slides. A gradient is carried outwards by the transpose of that (the
adjoint). BLOCK points are taken at once and every row of a block is as long, so that compilers make vector code of it.
`oio.kinematics.forward` says the same, pose by pose; a test holds both to the same numbers.
"""

from typing import NamedTuple

import numpy as np

from oio.core.compiled import compiled
from oio.core.records import Array
from oio.kinematics.forward import SLIDE, SerialChain

TWO_PI, TWO_PI_REST = 6.283185307179586, 2.4492935982947064e-16  # 2 pi
BLOCK = 32
ROWS = 5  # of a joint: sin, cos, and the slope of the point by the joint, before P


class AdjointChain(NamedTuple):
    """The n joints that move, as the loops below want them."""

    rotations: Array  # P (n, 9), row by row
    joints: Array  # (n, 7): axis w (3), place (3), whether it slides
    nose: Array  # (3,) m, in the frame of the last joint


def adjoint_chain(chain: SerialChain, n: int) -> AdjointChain:
    """Of a chain as `nose_and_jacobian` takes it, the n joints that move; the others are locked and only carry the nose along."""
    poses, axes, kinds, locked, offset = chain
    turns = np.ascontiguousarray(poses[:, :3, :3]).reshape(-1, 9)
    others = np.column_stack([axes, poses[:, :3, 3], np.asarray(kinds == SLIDE, dtype=np.float64)])
    joints, nose = np.repeat(np.asarray(locked[n:], dtype=np.float64)[:, None], BLOCK, axis=1), np.empty((3, BLOCK))
    forward_positions(
        joints, AdjointChain(turns[n:], others[n:], np.asarray(offset, dtype=np.float64)), np.empty((len(joints), ROWS, BLOCK)), nose
    )
    return AdjointChain(turns[:n].copy(), others[:n].copy(), nose[:, 0].copy())


@compiled
def forward_positions(q: Array, links: AdjointChain, joints: Array, p: Array) -> None:
    """The nose p (3, BLOCK) in the base frame for joints q (n, BLOCK); what `gradient_by_joints` wants goes to `joints` (n, ROWS,
    BLOCK)."""
    turns, axes, nose = links
    for a in range(3):
        p[a].fill(nose[a])
    for j in range(len(turns) - 1, -1, -1):
        w, at = axes[j], joints[j]
        if w[6] > 0.0:
            for a in range(3):
                at[2 + a].fill(w[a])
                for k in range(BLOCK):
                    p[a, k] += w[a] * q[j, k]
            at[0].fill(0.0)
            at[1].fill(1.0)
        else:
            _sin_cos(q[j], at)
            _rotate(p, at, w[0], w[1], w[2])
        t = turns[j]
        _transform(p, t[0], t[1], t[2], t[3], t[4], t[5], t[6], t[7], t[8], w[3], w[4], w[5])


@compiled
def gradient_by_joints(gradient: Array, links: AdjointChain, joints: Array, by_q: Array) -> None:
    """by_q (n, BLOCK) = g' dp/dq of gradients g (3, BLOCK) in the base frame, which end in the frame of the nose."""
    turns, axes, _ = links
    for j in range(len(turns)):
        t, w, at = turns[j], axes[j], joints[j]
        _transform(gradient, t[0], t[3], t[6], t[1], t[4], t[7], t[2], t[5], t[8], 0.0, 0.0, 0.0)
        _rotate_back(gradient, at, w[0], w[1], w[2], by_q[j])


@compiled
def _rotate(p: Array, at: Array, wx: float, wy: float, wz: float) -> None:
    """p = R p, and dp / dq to the last rows of `at`."""
    for k in range(BLOCK):
        x, y, z, s, c = p[0, k], p[1, k], p[2, k], at[0, k], at[1, k]
        along = wx * x + wy * y + wz * z
        ax, ay, az = along * wx, along * wy, along * wz
        cx, cy, cz = wy * z - wz * y, wz * x - wx * z, wx * y - wy * x
        x, y, z = x - ax, y - ay, z - az
        at[2, k], at[3, k], at[4, k] = c * cx - s * x, c * cy - s * y, c * cz - s * z
        p[0, k], p[1, k], p[2, k] = ax + c * x + s * cx, ay + c * y + s * cy, az + c * z + s * cz


@compiled
def _rotate_back(p: Array, at: Array, wx: float, wy: float, wz: float, by_q: Array) -> None:
    """by_q = p' dp/dq, p = R' p."""
    for k in range(BLOCK):
        x, y, z, s, c = p[0, k], p[1, k], p[2, k], at[0, k], at[1, k]
        by_q[k] = x * at[2, k] + y * at[3, k] + z * at[4, k]
        along = wx * x + wy * y + wz * z
        ax, ay, az = along * wx, along * wy, along * wz
        p[0, k] = ax + c * (x - ax) - s * (wy * z - wz * y)
        p[1, k] = ay + c * (y - ay) - s * (wz * x - wx * z)
        p[2, k] = az + c * (z - az) - s * (wx * y - wy * x)


@compiled
def _transform(
    p: Array, a: float, b: float, c: float, d: float, e: float, f: float, g: float, h: float, i: float, x0: float, y0: float, z0: float
) -> None:
    """p = p_0 + P p."""
    for k in range(BLOCK):
        x, y, z = p[0, k], p[1, k], p[2, k]
        p[0, k], p[1, k], p[2, k] = x0 + a * x + b * y + c * z, y0 + d * x + e * y + f * z, z0 + g * x + h * y + i * z


@compiled
def _sin_cos(x: Array, out: Array) -> None:
    """sin and cos, the first rows of out (2, BLOCK), of x (BLOCK,) to some 1e-15: a whole turn is taken off, then Taylor's series of a
    quarter of the angle, doubled twice. The library's own take one number at a time, and longer than all the rest."""
    for k in range(BLOCK):
        turn = np.floor(x[k] * (0.5 / np.pi) + 0.5)
        y = 0.25 * (x[k] - turn * TWO_PI - turn * TWO_PI_REST)
        y2 = y * y
        s = 1 / 362880 + y2 * (-1 / 39916800 + y2 * (1 / 6227020800 - y2 / 1307674368000))
        s = y + y * y2 * (-1 / 6 + y2 * (1 / 120 + y2 * (-1 / 5040 + y2 * s)))
        c = -1 / 3628800 + y2 * (1 / 479001600 + y2 * (-1 / 87178291200 + y2 / 20922789888000))
        c = 1.0 - y2 * (0.5 - y2 * (1 / 24 + y2 * (-1 / 720 + y2 * (1 / 40320 + y2 * c))))
        s, c = 2.0 * s * c, 1.0 - 2.0 * s * s
        out[0, k], out[1, k] = 2.0 * s * c, 1.0 - 2.0 * s * s
