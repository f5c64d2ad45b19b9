"""Evidence of noise parameters, all others integrated out: restricted likelihood (Patterson & Thompson 1971, Biometrika 58:545).

With theta = mean + L u, u standard normal, and the model linear about the fit, whitened residuals e and rows R = d e / d u give

-2 ln Z = |e|^2 + |u|^2 - g' H^-1 g + sum ln S + ln det H,   H = R' R + I,   g = R' e - u,

up to a constant, with the innovation variances S. A fit with many parameters makes its residuals small; their likelihood takes that for
little noise, the evidence does not.
"""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from oio.core.records import Array
from oio.gas.fluctuation import Fluctuation, PathField
from oio.gas.whitening import whiten
from oio.inference.forward_model import Problem

SWAYS = (0.0, 0.05, 0.1, 0.15, 0.2, 0.3)  # strengths tried, equally likely before
TIMES_S = (3.0, 6.0, 12.0)  # correlation times of each
GAMMAS = (0.02, 0.04, 0.07, 0.1, 0.15, 0.22, 0.32, 0.5)  # of the eddies beside it
EDDIES_S = (0.15, 0.3, 0.6, 1.2, 2.4, 5.0)


def linearised(problem: Problem, theta: Array) -> tuple[PathField, Array, Array]:
    """Return the path, residuals beside their rows (m, 1 + P) [ppm] in units of the prior, and theta in them (P,)."""
    expected, root = problem.predict(theta), np.linalg.cholesky(problem.cov)
    columns = np.concatenate([problem.residual(theta, expected.ppm)[:, None], expected.rows @ root], axis=1)
    return expected.along, columns, np.asarray(np.linalg.solve(root, theta - problem.mean))


def minus_2_log_evidence(columns: Array, u: Array, along: PathField, noise: Fluctuation) -> float:
    """-2 ln Z, up to a constant, of residuals and rows (m, 1 + P) about u (P,)."""
    white = whiten(columns, along, noise)
    e, rows = white.rows[:, 0], white.rows[:, 1:]
    low = np.linalg.cholesky(rows.T @ rows + np.eye(len(u)))
    y = np.linalg.solve(low, rows.T @ e - u)
    return float(e @ e + u @ u - y @ y + np.sum(np.log(white.expected_ppm2)) + 2.0 * np.sum(np.log(np.diag(low))))


def likeliest_sway(columns: Array, u: Array, along: PathField, like: Fluctuation) -> Fluctuation:
    """Return the noise with the root mean square sway over its posterior, and the likeliest times and eddies for the nearest one tried."""
    noises = [noise for sway in SWAYS for noise in _choices(sway, like)]
    costs = np.array([minus_2_log_evidence(columns, u, along, noise) for noise in noises])
    sways, weights = np.array([noise.sway for noise in noises]), np.exp(-0.5 * (costs - np.min(costs)))
    weights[sways > 0.0] /= len(TIMES_S)
    sway = float(np.sqrt(weights @ sways**2 / np.sum(weights)))
    nearest = min(SWAYS, key=lambda tried: abs(tried - sway))
    return replace(noises[int(np.argmin(np.where(sways == nearest, costs, np.inf)))], sway=sway)


def _choices(sway: float, like: Fluctuation) -> Iterable[Fluctuation]:
    for sway_s in TIMES_S if sway > 0.0 else (like.sway_s,):
        for gamma in GAMMAS:
            for t_s in EDDIES_S:
                yield replace(like, gamma=gamma, t_s=t_s, sway=sway, sway_s=sway_s)
