"""Quaternions x, y, z, w, as poses of viewers have them. (`scipy.spatial.transform` has them too, at 0.1 s of import.)"""

import numpy as np

from oio.core.records import Array


def quaternion(rotation: Array) -> Array:
    """Return the unit quaternion (4,) of a rotation matrix (3, 3), by Markley's choice of the largest component (2008, J. Guid. 31:440)."""
    m, trace = rotation, float(np.trace(rotation))
    i = int(np.argmax([m[0, 0], m[1, 1], m[2, 2], trace]))
    if i == 3:
        q = np.array([m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], 1.0 + trace])
        return np.asarray(q / np.linalg.norm(q))
    j, k, q = (i + 1) % 3, (i + 2) % 3, np.empty(4)
    q[i], q[j], q[k], q[3] = 1.0 - trace + 2.0 * m[i, i], m[j, i] + m[i, j], m[k, i] + m[i, k], m[k, j] - m[j, k]
    return np.asarray(q / np.linalg.norm(q))


def rotation(xyzw: Array) -> Array:
    """Return the rotation matrix (3, 3) of a quaternion (4,) of any length but zero."""
    x, y, z, w = np.asarray(xyzw) / np.linalg.norm(xyzw)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def product(a: Array, b: Array) -> Array:
    """Return Hamilton's products a b (k, 4) of a (k, 4) and b (k, 4): the rotation b, then a."""
    (ax, ay, az, aw), (bx, by, bz, bw) = a.T, b.T
    return np.stack(
        [
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
            aw * bw - ax * bx - ay * by - az * bz,
        ],
        axis=1,
    )
