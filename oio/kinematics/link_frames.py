"""Frames of the links from the joints, each in the frame before it, for viewers: base, link1, ..., linkM, nose."""

import numpy as np

from oio.core.quaternions import product, quaternion
from oio.core.records import Array
from oio.kinematics.forward import SLIDE, SerialChain


class LinkFrames:
    """The frames of a chain of m joints; link j turns and slides with joint j, and the nose is fixed to the last."""

    def __init__(self, chain: SerialChain) -> None:
        poses, self._axes, kinds, self._locked, offset = chain
        self._slides = np.asarray(kinds == SLIDE)
        self.steps_m = np.vstack([poses[:, :3, 3], offset])  # (m + 1, 3): in each frame, where the next begins
        self._turns = np.array([quaternion(pose[:3, :3]) for pose in poses])
        self._directions = np.array([pose[:3, :3] @ axis for pose, axis in zip(poses, self._axes, strict=True)])  # in the frame before

    def at(self, q: Array) -> tuple[Array, Array]:
        """Places (m + 1, 3) m and quaternions (m + 1, 4) for the unlocked joints q (n,) rad or m; the others stay where they are locked."""
        values = np.concatenate([q, self._locked[len(q) :]])
        places, turns = self.steps_m.copy(), np.tile([0.0, 0.0, 0.0, 1.0], (len(values) + 1, 1))
        places[:-1] += np.where(self._slides, values, 0.0)[:, None] * self._directions
        half = 0.5 * np.where(self._slides, 0.0, values)
        turns[:-1] = product(self._turns, np.column_stack([self._axes * np.sin(half)[:, None], np.cos(half)]))
        return places, turns

    def rails(self, low: Array, high: Array) -> list[tuple[int, Array, Array]]:
        """Of every joint that slides: the number of the frame before it, and in that frame its two ends (3,) m at the limits (m,)."""
        return [
            (int(j), self.steps_m[j] + low[j] * self._directions[j], self.steps_m[j] + high[j] * self._directions[j])
            for j in np.flatnonzero(self._slides)
        ]


def in_base(places_m: Array, turns: Array) -> Array:
    """Origins (k, m + 2, 3) m in the base frame, the base's own first, of frames each in the one before: places (k, m + 1, 3) m and
    quaternions (k, m + 1, 4)."""
    origins, turned = [np.zeros_like(places_m[:, 0])], np.tile([0.0, 0.0, 0.0, 1.0], (len(turns), 1))
    for place, turn in zip(places_m.swapaxes(0, 1), turns.swapaxes(0, 1), strict=True):
        v, w = turned[:, :3], turned[:, 3:]
        across = 2.0 * np.cross(v, place)
        origins.append(origins[-1] + place + w * across + np.cross(v, across))  # the rotation of a vector by a unit quaternion
        turned = product(turned, turn)
    return np.stack(origins, axis=1)
