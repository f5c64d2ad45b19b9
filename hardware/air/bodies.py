"""Solid bodies in the air of the simulator: planes and boxes that reflect or block gas, and the arm's own shadow.

A plane that lets nothing through doubles the source by its mirror image: exact for diffusion at right angles to it (image method,
Crank 1975, 2.2.4), an approximation where wind blows through the plane. Two planes at right angles make the images of images. A box is
rougher: it is transparent but for a share of the gas whose straight line from the source it crosses, and it reflects by the plane of the
face nearest to the source. The arm blocks likewise, as capsules about its links. None of them moves the wind.
"""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from oio.core.records import Array

PARALLEL = 1e-12  # squared sine of the angle below which two segments are taken as parallel, whatever their lengths
Field = Callable[[Array], float]  # concentration [ppm] at (3,) m


@dataclass(frozen=True, slots=True, eq=False)
class Plane:
    """Wall through `point_m` (3,) with unit `normal` (3,) towards the gas: it reflects the share `reflects` and has no gas behind."""

    point_m: Array
    normal: Array
    reflects: float = 1.0

    def height_m(self, p_m: Array) -> float:
        """Distance of (3,) m from the wall, negative behind it."""
        return float((p_m - self.point_m) @ self.normal)

    def through(self, field: Field) -> Field:
        """Return the field with this wall in it."""
        return partial(self._field, field)

    def _field(self, field: Field, p_m: Array) -> float:
        height = self.height_m(p_m)
        if height < 0.0:
            return 0.0
        return field(p_m) + self.reflects * field(p_m - 2.0 * height * self.normal)


@dataclass(frozen=True, slots=True, eq=False)
class Box:
    """Box from `low_m` to `high_m` (3,) m: `reflects` at the face nearest to the source, and lets through `transmits` of what it hides."""

    low_m: Array
    high_m: Array
    source_m: Array
    reflects: float = 1.0
    transmits: float = 0.2

    def through(self, field: Field) -> Field:
        """Return the field with this box in it."""
        return partial(self._field, field, self._nearest_face())

    def _field(self, field: Field, face: Plane, p_m: Array) -> float:
        if np.all((p_m > self.low_m) & (p_m < self.high_m)):
            return 0.0
        direct = field(p_m) * (self.transmits if self.hides(p_m) else 1.0)
        height = face.height_m(p_m)
        foot = p_m - height * face.normal
        faces_it = height > 0.0 and bool(np.all((foot >= self.low_m - 1e-9) & (foot <= self.high_m + 1e-9)))
        return direct + (self.reflects * field(p_m - 2.0 * height * face.normal) if faces_it else 0.0)

    def _nearest_face(self) -> Plane:
        outside = np.concatenate([self.low_m - self.source_m, self.source_m - self.high_m])  # positive: the source is beyond this face
        i = int(np.argmax(outside))
        normal = np.zeros(3)
        normal[i % 3] = -1.0 if i < 3 else 1.0
        return Plane(self.low_m if i < 3 else self.high_m, normal)

    def hides(self, p_m: Array) -> bool:
        """Whether the straight line from the source to (3,) m crosses the box (slab test, Kay & Kajiya 1986)."""
        d = p_m - self.source_m
        with np.errstate(divide="ignore", invalid="ignore"):
            a, b = (self.low_m - self.source_m) / d, (self.high_m - self.source_m) / d
        enters, leaves = np.nanmax(np.fmin(a, b)), np.nanmin(np.fmax(a, b))
        return bool(enters < leaves and leaves > 0.0 and enters < 1.0)


def shadow(source_m: Array, p_m: Array, joints_m: Array, radius_m: float, transmits: float) -> float:
    """Share of the gas that passes the arm's links, capsules of `radius_m` between `joints_m` (j, 3) m, from the source to (3,) m.

    The last link carries the nose, which would always lie in its own shadow: it ends two radii before it.
    """
    joints_m = np.array(joints_m)
    last = joints_m[-1] - joints_m[-2]
    joints_m[-1] -= last * min(2.0 * radius_m / max(float(np.linalg.norm(last)), 1e-9), 1.0)
    for a, b in itertools.pairwise(joints_m):
        if segment_distance_m(source_m, p_m, a, b) < radius_m:
            return transmits
    return 1.0


def segment_distance_m(a: Array, b: Array, c: Array, d: Array) -> float:
    """Distance of the segments ab and cd (Ericson 2005, Real-Time Collision Detection, 5.1.9)."""
    u, v, w = b - a, d - c, a - c
    uu, vv, uv, uw, vw = (float(x @ y) for x, y in ((u, u), (v, v), (u, v), (u, w), (v, w)))
    det = uu * vv - uv * uv
    s = min(max((uv * vw - vv * uw) / det, 0.0), 1.0) if det > PARALLEL * uu * vv else 0.0
    t = min(max((uv * s + vw) / vv, 0.0), 1.0) if vv > 0.0 else 0.0
    s = min(max((uv * t - uw) / uu, 0.0), 1.0) if uu > 0.0 else 0.0
    return float(np.linalg.norm(w + s * u - t * v))


def with_bodies(field: Field, bodies: Sequence[Plane | Box]) -> Field:
    """Return the field with all bodies in it; planes nest, so that a corner has the image of the image."""
    for body in bodies:
        field = body.through(field)
    return field
