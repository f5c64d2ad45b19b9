"""Metrics of a source estimate: error, NEES and coverage; quantities that are unobservable at a DoF are not scored."""

from dataclasses import dataclass

import numpy as np

from oio.core.records import Array
from oio.kinematics.arm import Arm

COVERAGE = 0.95
CHI2_95 = {1: 3.841458820694124, 2: 5.991464547107979, 3: 7.814727903251179}  # by degrees of freedom; scipy.special is 0.1 s of import


@dataclass(frozen=True, slots=True)
class ResidualTest:
    """Whitened residuals of a fit: their mean square (1 is consistent), and their autocorrelation at lag one (0 is white); and by how much
    two halves of the readings disagree on the source (squared Mahalanobis distance, chi-square with 3 degrees of freedom)."""

    mean_square: float
    autocorrelation: float
    halves: float = 0.0  # the earlier against the later, or one side of the source against the other, whichever is larger

    @property
    def overdispersion(self) -> float:
        """Factor, at least 1, by which the readings say less than their likelihood: mean square times (1 + rho) / (1 - rho)."""
        rho = min(max(self.autocorrelation, 0.0), 0.9)
        return max(self.mean_square * (1.0 + rho) / (1.0 - rho), 1.0)


@dataclass(frozen=True, slots=True)
class SourceScore:
    """Score of a source estimate: error [m], or bearing error [deg] if the DoF cannot observe a position; NEES and its dimension."""

    source_error_m: float | None
    bearing_error_deg: float | None
    nees: float
    dimension: int

    @property
    def inside_95(self) -> bool:
        """Whether the truth lies in the 95 % confidence region."""
        return bool(self.nees <= CHI2_95[self.dimension])


def nees(error: Array, cov: Array) -> float:
    """Normalised estimation error squared e' P^-1 e (Bar-Shalom, Li, Kirubarajan 2001, 5.4)."""
    return float(error @ np.linalg.solve(cov, error))


def score_source(mean: Array, cov: Array, truth: Array, arm: Arm) -> SourceScore:
    """Score the position for three or more joints; azimuth for one joint, azimuth and elevation for two, seen from the shoulder."""
    if arm.dof >= 3:
        return SourceScore(float(np.linalg.norm(mean - truth)), None, nees(mean - truth, cov), 3)
    origin = arm.shoulder
    angles, jacobian = bearing(mean - origin)
    true_angles, _ = bearing(truth - origin)
    difference = (angles - true_angles + np.pi) % (2 * np.pi) - np.pi
    dimension = arm.dof
    angle_cov = (jacobian @ cov @ jacobian.T)[:dimension, :dimension]
    error = np.degrees(_great_circle(mean - origin, truth - origin)) if dimension == 2 else abs(np.degrees(difference[0]))
    return SourceScore(None, float(error), nees(difference[:dimension], angle_cov), dimension)


def bearing(d: Array) -> tuple[Array, Array]:
    """Azimuth and elevation (2,) rad of a direction (3,), and their Jacobian (2, 3)."""
    x, y, z = d
    rho2 = max(x * x + y * y, 1e-12)
    rho, r2 = np.sqrt(rho2), max(float(d @ d), 1e-12)
    angles = np.array([np.arctan2(y, x), np.arctan2(z, rho)])
    return angles, np.array([[-y / rho2, x / rho2, 0.0], [-x * z / (rho * r2), -y * z / (rho * r2), rho / r2]])


def _great_circle(a: Array, b: Array) -> float:
    cosine = float(a @ b) / float(np.linalg.norm(a) * np.linalg.norm(b))
    return float(np.arccos(np.clip(cosine, -1.0, 1.0)))


def rms(values: list[float]) -> float | None:
    """Root mean square; None if `values` is empty."""
    return float(np.sqrt(np.mean(np.square(values)))) if values else None
