"""Immutable records of samples, readings, beliefs and innovations. Time is int nanoseconds since the world opened, all else SI or ppm."""

import functools
import math
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
SECOND_NS = 1_000_000_000
_ARRAYS = (np.ndarray, list)
_FLOAT = np.dtype(np.float64)
_SCALARS = (int, float, bool, str)


def seconds(t_ns: int) -> float:
    """Nanoseconds as seconds."""
    return t_ns / SECOND_NS


def nanoseconds(t_s: float) -> int:
    """Seconds as whole nanoseconds."""
    return round(t_s * SECOND_NS)


@functools.cache
def _not_scalars(kind: Any) -> tuple[str, ...]:
    """Names of the fields that may hold arrays; kept, because a world and a filter make a hundred records a second."""
    return tuple(field.name for field in fields(kind) if field.type not in _SCALARS)


class _ReadOnlyArrays:
    """Base of records: arrays are copied to float64 and made read-only."""

    __slots__ = ()

    def __post_init__(self) -> None:
        for name in _not_scalars(type(self)):  # type: ignore[arg-type]  # mypy takes the hash of its instances for that of a class
            value: Any = getattr(self, name)
            if isinstance(value, _ARRAYS):
                array = value.copy("K") if type(value) is np.ndarray and value.dtype is _FLOAT else np.array(value, dtype=np.float64)
                array.setflags(write=False)
                object.__setattr__(self, name, array)


@dataclass(frozen=True, slots=True, eq=False)
class JointState(_ReadOnlyArrays):
    """Joint state from the encoders: q (n,) rad, velocity dq (n,) rad/s, acceleration ddq (n,) rad/s^2 of the n unlocked joints."""

    t_ns: int
    q: Array
    dq: Array
    ddq: Array


@dataclass(frozen=True, slots=True, eq=False)
class GasSample:
    """Raw gas sample of one sensor element, in the unit of its sensor (ppm, ADC counts)."""

    t_ns: int
    element: int
    raw: float


@dataclass(frozen=True, slots=True, eq=False)
class Truth(_ReadOnlyArrays):
    """Ground truth, for scoring only: joints (n,) rad, nose (3,) m, open source (3,) m (NaN: none), concentration at the nose [ppm]."""

    t_ns: int
    q: Array
    nose_m: Array
    source_m: Array
    ppm: float


@dataclass(frozen=True, slots=True, eq=False)
class Event:
    """Log event: `kind` is a word (`present`, `move`, `bout`, `stage`, `dropped` ...), `text` a sentence."""

    t_ns: int
    kind: str
    text: str


Sample = JointState | GasSample
WorldSample = JointState | GasSample | Truth | Event


@dataclass(frozen=True, slots=True, eq=False)
class GasReading:
    """Gas reading in ppm with the standard uncertainty of white sensor noise alone; if `censored`, the value is an upper bound."""

    t_ns: int
    element: int
    ppm: float
    sigma_ppm: float
    censored: bool = False

    @property
    def missed(self) -> bool:
        """Whether this is a missed reading: value or uncertainty is not finite."""
        return not (math.isfinite(self.ppm) and math.isfinite(self.sigma_ppm))


@dataclass(frozen=True, slots=True, eq=False)
class Belief(_ReadOnlyArrays):
    """Gaussian belief of the state: mean (n,), cov (n, n); the state space has `names` and `units` for its entries."""

    t_ns: int
    mean: Array
    cov: Array


@dataclass(frozen=True, slots=True, eq=False)
class FilterEstimate(_ReadOnlyArrays):
    """Nose (3,) m and source (3,) m with their covariances (3, 3) m^2, by a filter that was run over the log of a search: its `variant`."""

    t_ns: int
    variant: str
    nose_m: Array
    nose_cov: Array
    source_m: Array
    source_cov: Array


@dataclass(frozen=True, slots=True, eq=False)
class Innovation(_ReadOnlyArrays):
    """Innovation, measurement minus prediction: residual (m,) ppm, cov (m, m) ppm^2; `gated` if it was rejected by the gate."""

    t_ns: int
    residual: Array
    cov: Array
    gated: bool

    @property
    def nis(self) -> float:
        """Normalised innovation squared y' S^-1 y, chi-square with m degrees of freedom if the filter is consistent."""
        if len(self.residual) == 1 and self.cov[0, 0]:  # as of every gas reading; equal to the bit, without the calls of LAPACK
            y = float(self.residual[0])
            return y * (y / float(self.cov[0, 0]))
        return float(self.residual @ np.linalg.solve(self.cov, self.residual))
