"""Trajectories over time, with covariances."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from oio.core.records import Array, FilterEstimate, seconds

Indices = NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class Span:
    """Time span of one stage [s] since the world opened."""

    stage: str
    begin_s: float
    end_s: float


@dataclass(frozen=True, slots=True, eq=False)
class TrackOverTime:
    """Trajectory: t_s (k,) s, p_m (k, 3) m in the base frame, cov_m2 (k, 3, 3) m^2 (zero where nothing is uncertain)."""

    t_s: Array
    p_m: Array
    cov_m2: Array

    def __len__(self) -> int:
        return len(self.t_s)

    def during(self, span: Span) -> "TrackOverTime":
        """Return the part inside a span."""
        inside = (self.t_s >= span.begin_s) & (self.t_s <= span.end_s)
        return TrackOverTime(self.t_s[inside], self.p_m[inside], self.cov_m2[inside])

    def distances(self, truth: "TrackOverTime") -> tuple[Array, Array]:
        """Return t_s (j,) and distance (j,) m at common time stamps only: in 20 ms the nose moves by more than its error."""
        t_s, own, other = self.matched(truth)
        return t_s, np.linalg.norm(self.p_m[own] - truth.p_m[other], axis=1)

    def matched(self, truth: "TrackOverTime") -> tuple[Array, Indices, Indices]:
        """Return the common time stamps t_s (j,), each once, and where both tracks have them (j,)."""
        t_s, own, other = np.intersect1d(self.t_s, truth.t_s, return_indices=True)
        return t_s, own, other


def track_over_time(rows: Any) -> TrackOverTime:
    """Return the trajectory of (t_ns, p (3,) m, covariance (3, 3) m^2 or None); entries that are not finite are left out."""
    rows = list(rows)
    if not rows:
        return TrackOverTime(np.zeros(0), np.zeros((0, 3)), np.zeros((0, 3, 3)))
    t_s, p = np.array([seconds(t_ns) for t_ns, _, _ in rows]), np.array([at for _, at, _ in rows], dtype=float)
    cov = np.array([np.zeros((3, 3)) if of is None else of for _, _, of in rows], dtype=float)
    finite = np.all(np.isfinite(p), axis=1) & np.all(np.isfinite(cov), axis=(1, 2))
    return TrackOverTime(t_s[finite], p[finite], cov[finite])


@dataclass(frozen=True, slots=True, eq=False)
class Estimates:
    """What a filter believed over the search: nose and source."""

    nose: TrackOverTime
    source: TrackOverTime


def estimates_by_variant(estimates: Iterable[FilterEstimate]) -> dict[str, Estimates]:
    """Return what each variant believed, by its name."""
    rows: dict[str, list[FilterEstimate]] = {}
    for one in estimates:
        rows.setdefault(one.variant, []).append(one)
    return {
        name: Estimates(
            track_over_time((one.t_ns, one.nose_m, one.nose_cov) for one in some),
            track_over_time((one.t_ns, one.source_m, one.source_cov) for one in some),
        )
        for name, some in rows.items()
    }


def places_left(search: Any) -> tuple[tuple[Array, Array], ...]:
    """Return the places that the last map of a search left, best first, from its result in the log; only those that are finite."""
    maps = (search or {}).get("maps", [])
    fits = [(np.array(fit["mean"], dtype=float)[:3], np.array(fit["cov"], dtype=float)[:3, :3]) for fit in (maps[-1] if maps else [])]
    return tuple((mean, cov) for mean, cov in fits if np.all(np.isfinite(mean)) and np.all(np.isfinite(cov)))
