"""Emitters: what releases gas where and when. A source is a point, a line, a ring or a disc; its emission may start, fade or pulse."""

import math
from dataclasses import dataclass

import numpy as np

from oio.core.records import Array

SHAPES = ("point", "line", "ring", "disc")
GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0  # its multiples fill the unit interval evenly, without random numbers
PLASTIC = 0.7548776662466927  # likewise for a second coordinate (Roberts 2018, the R2 sequence)


@dataclass(frozen=True, slots=True)
class Shape:
    """Shape of a source: half length of a line, radius of a ring or disc [m], and its axis: along the line, or normal to the plane."""

    kind: str
    size_m: float
    axis: tuple[float, float, float]

    def offsets_m(self, first: int, count: int) -> Array:
        """Return where puffs number `first`, `first` + 1 ... are released, (count, 3) m from the centre, evenly over the shape."""
        if self.kind == "point" or self.size_m == 0.0:
            return np.zeros((count, 3))
        number = np.arange(first, first + count)
        u, v = (number * GOLDEN) % 1.0, (number * PLASTIC) % 1.0
        normal, across, along = _frame(np.array(self.axis))
        if self.kind == "line":
            return np.asarray(self.size_m * np.multiply.outer(2.0 * u - 1.0, normal))
        r = self.size_m * (np.sqrt(v) if self.kind == "disc" else np.ones(count))
        angle = 2.0 * np.pi * u
        return np.asarray(np.multiply.outer(r * np.cos(angle), across) + np.multiply.outer(r * np.sin(angle), along))


@dataclass(frozen=True, slots=True)
class Release:
    """Emission over time, relative to the full rate; t = 0 when the source opens. Before that the plume developed at the full rate."""

    starts_s: float = 0.0  # no emission before this; above 0 there is no developed plume
    fade_s: float = math.inf  # time constant of an exponential decay from t = 0 on
    pulse_s: float = math.inf  # period of on and off,
    duty: float = 1.0  # and the share of it that is on

    def share(self, t_s: Array) -> Array:
        """Emission rate (n,) at t_s (n,), over the full rate."""
        on = (t_s >= self.starts_s) if self.starts_s > 0.0 else np.ones(len(t_s), dtype=bool)
        if math.isfinite(self.pulse_s):
            on &= (t_s / self.pulse_s) % 1.0 < self.duty
        return np.where(on, np.exp(-np.maximum(t_s, 0.0) / self.fade_s), 0.0)


STEADY = Release()


@dataclass(frozen=True, slots=True, eq=False)
class Emitter:
    """One source: centre (3,) m, full emission rate [ml/s], shape, and emission over time."""

    place_m: Array
    rate_ml_s: float
    shape: Shape = Shape("point", 0.0, (0.0, 0.0, 1.0))
    release: Release = STEADY

    @property
    def is_plain(self) -> bool:
        """Whether this is a point at a constant rate."""
        return self.shape.kind == "point" and self.release == STEADY


def _frame(axis: Array) -> tuple[Array, Array, Array]:
    """Right-handed orthonormal frame whose first axis is `axis` (3,), normalised."""
    normal = axis / np.linalg.norm(axis)
    across = np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
    across /= np.linalg.norm(across)
    return normal, across, np.cross(normal, across)
