"""Alternative worlds: what may have changed since calibration, each a fit problem of its own, compared with the calibrated one by evidence.

Calibration is a prior about the room as it was. Alternatives reopen the wind, the lag or the joints, let strength, wind or background
change with time, add a second source or walls, or extend the source to a line or ring. Their evidence is the marginal likelihood in
Laplace's approximation (MacKay 2003, ch. 28), so that the volume of every additional prior is charged.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Annotated

import numpy as np

from oio.core.errors import BadInput
from oio.core.records import Array
from oio.core.settings import Within, settings
from oio.gas.range_law import WIND
from oio.gas.source_shape import CORNER, LINE, RING, TWO, WALL
from oio.inference.alternative_starts import corner_starts, extended_source_starts, second_source_starts, wall_starts, wind_starts
from oio.inference.forward_model import Problem
from oio.inference.law_extension import Densities, LawExtension, random_walk_cov
from oio.inference.map_fit import Fit

WORLDS = {  # keys of the configuration, and what verdicts say
    "wind": "another wind",
    "wind_changes": "a wind that changes",
    "strength_changes": "a strength that changes",
    "background_changes": "a background that changes",
    "second_source": "a second source",
    "wall": "a wall",
    "corner": "a corner of two walls",
    "lag": "another lag",
    "joints": "joints elsewhere",
    "line": "a source that is a line",
    "ring": "a source that is a ring",
}


@settings
class Alternatives:
    """Which alternatives are fitted beside the calibrated world, and their priors."""

    worlds: tuple[str, ...]  # of WORLDS
    knot_s: Annotated[float, Within(0.1, 1e6)]  # distance in time of the knots between which a change is linear,
    most_knots: Annotated[int, Within(1, 100)]  # but at most so many
    wind_per_m_sqrt_s: Annotated[float, Within(0, 1e3)]  # densities of the random walks
    strength_sqrt_s: Annotated[float, Within(0, 10)]
    background_sigmas_sqrt_s: Annotated[float, Within(0, 1e3)]  # in standard deviations of a reading
    second_strength_u: Annotated[float, Within(0.01, 10)]  # standard deviation of ln(strength of the second source / first)
    wall_u_m: Annotated[float, Within(1e-3, 1)]  # of the foot of the source on a wall, on each axis, standard deviation
    lag_u: Annotated[float, Within(1e-3, 3)]  # standard deviation of ln(lag / lag at calibration)
    drift_factor: Annotated[float, Within(0, 1e3)]  # encoder drift over the arm's
    offset_u_deg: Annotated[float, Within(0, 90)]  # of a joint since calibration, standard uncertainty
    extent_u_m: Annotated[float, Within(1e-4, 1)]  # of a line's half length, or a ring's radius, on each axis, standard deviation
    inflation: Annotated[float, Within(1, 100)]  # of the covariance of an alternative: no beacon has shown how well its law holds
    prior_odds: Annotated[float, Within(1e-9, 1e3)]  # of each alternative against the calibrated world

    def check(self) -> None:
        """Raise BadInput for an unknown world."""
        if unknown := [world for world in self.worlds if world not in WORLDS]:
            given = f"belief_map.alternatives.worlds has '{unknown[0]}'"
            raise BadInput(f"{given}, but it can be {', '.join(WORLDS)}. Type e.g. belief_map.alternatives.worlds=[wind,second_source].")

    @property
    def none(self) -> "Alternatives":
        """No alternatives."""
        return replace(self, worlds=())

    def of(self, problem: Problem, best: Fit) -> Iterator[tuple[str, Callable[[Mapping[str, Fit]], "Alternative"]]]:
        """Yield the name of every alternative to the problem, whose best fit is given, and how it is made from the fits of those before."""
        makers = {
            "wind": lambda name, _: Alternative(name, reopen_wind(problem), wind_starts(problem, best)),
            "wind_changes": lambda name, _: self._walk(name, reopen_wind(problem), best, "wind"),
            "strength_changes": lambda name, _: self._walk(name, problem, best, "strength"),
            "background_changes": lambda name, _: self._walk(name, problem, best, "background"),
            "second_source": lambda name, _: self._second_source(name, problem, best),
            "wall": lambda name, _: self._wall(name, problem, best),
            "corner": lambda name, fitted: self._corner(name, problem, fitted.get(WORLDS["wall"], best)),
            "lag": lambda name, _: self._lag(name, problem, best),
            "joints": lambda name, _: self._joints(name, problem, best),
            "line": lambda name, _: self._line_or_ring(name, problem, best, LINE),
            "ring": lambda name, _: self._line_or_ring(name, problem, best, RING),
        }
        for key in self.worlds:
            yield WORLDS[key], partial(makers[key], WORLDS[key])

    def _second_source(self, name: str, problem: Problem, best: Fit) -> "Alternative":
        low, high = np.array(problem.arm.box_low_m), np.array(problem.arm.box_high_m)
        extended = of_shape(problem, TWO, np.diag([*(((high - low) / 2) ** 2 / 3.0), self.second_strength_u**2]))
        mean = np.array(extended.mean)
        mean[problem.layout.size :] = [*((low + high) / 2), 0.0]
        return Alternative(name, replace(extended, mean=mean), second_source_starts(problem, best))

    def _wall(self, name: str, problem: Problem, best: Fit) -> "Alternative":
        walled = of_shape(problem, WALL, self.wall_u_m**2 * np.eye(3))
        return Alternative(name, walled, wall_starts(walled, best))

    def _corner(self, name: str, problem: Problem, walled_or_not: Fit) -> "Alternative":
        walled = of_shape(problem, CORNER, self.wall_u_m**2 * np.eye(6))
        return Alternative(name, walled, corner_starts(walled, walled_or_not))

    def _line_or_ring(self, name: str, problem: Problem, best: Fit, kind: int) -> "Alternative":
        extended = of_shape(problem, kind, self.extent_u_m**2 * np.eye(3))
        return Alternative(name, extended, extended_source_starts(extended, best, self.extent_u_m))

    def _lag(self, name: str, problem: Problem, best: Fit) -> "Alternative":
        lay, cov, starts = problem.layout, np.array(problem.cov), list[Array]()
        cov[lay.tau, :] = cov[:, lay.tau] = 0.0
        cov[lay.tau, lay.tau] = self.lag_u**2
        for ln_factor in (0.0, self.lag_u):
            starts.append(np.array(best.mean))
            starts[-1][lay.tau] += ln_factor
        return Alternative(name, replace(problem, cov=cov), tuple(starts))

    def _joints(self, name: str, problem: Problem, best: Fit) -> "Alternative":
        n, lay = problem.arm.dof, problem.layout
        extension = LawExtension(joints=n, begins_s=float(problem.sniffs.t_s[0]))
        drift = np.eye(n) * (self.drift_factor * np.radians(problem.arm.encoder_drift_deg_s2)) ** 2 / 3.0 + 1e-18 * np.eye(n)
        moved = extend(problem, extension, [(extension.drift, drift)])
        cov = np.array(moved.cov)
        cov[lay.offset, lay.offset] += np.radians(self.offset_u_deg) ** 2 * np.eye(n)
        return Alternative(name, replace(moved, cov=cov), (np.concatenate([best.mean, np.zeros(n)]),))

    def _knots(self, problem: Problem) -> tuple[float, ...]:
        t = problem.sniffs.reading_t_s
        count = int(np.clip(round(float(t[-1] - t[0]) / self.knot_s), 1, self.most_knots))
        return tuple(float(v) for v in np.linspace(t[0], t[-1], count + 1))

    def _walk(self, name: str, problem: Problem, best: Fit, what: str) -> "Alternative":
        background, knots_s = self.background_sigmas_sqrt_s * float(np.median(problem.sniffs.sigma_ppm)), self._knots(problem)
        densities = Densities(self.strength_sqrt_s, self.wind_per_m_sqrt_s, background)
        if what == "strength":
            extension, cov = LawExtension(strength_s=knots_s, densities=densities), random_walk_cov(knots_s, self.strength_sqrt_s)
        elif what == "wind":
            extension = LawExtension(wind_s=knots_s, densities=densities)
            cov = np.asarray(np.kron(random_walk_cov(knots_s, self.wind_per_m_sqrt_s), np.eye(3)), dtype=np.float64)
        else:
            extension, cov = LawExtension(background_s=knots_s, densities=densities), random_walk_cov(knots_s, background)
        extended = extend(problem, extension, [(range(extension.size), cov)])
        return Alternative(name, extended, (np.concatenate([best.mean, np.zeros(extension.size)]),))


@dataclass(frozen=True, slots=True, eq=False)
class Alternative:
    """One alternative world: what is different, its fit problem, and start values (P,) for its fit."""

    name: str
    problem: Problem
    starts: tuple[Array, ...]


def extend(problem: Problem, extension: LawExtension, blocks: list[tuple[range, Array]]) -> Problem:
    """Return the problem with the parameters of an extension at the end of theta: mean zero, covariance by blocks."""
    n = problem.layout.size
    mean, cov = np.concatenate([problem.mean, np.zeros(extension.size)]), np.zeros((n + extension.size, n + extension.size))
    cov[:n, :n] = problem.cov
    for indices, block in blocks:
        at = n + np.array(indices)
        cov[np.ix_(at, at)] = block
    return replace(problem, mean=mean, cov=cov, extension=extension)


def of_shape(problem: Problem, kind: int, cov: Array) -> Problem:
    """Return the problem with a source of another kind of shape, whose parameters have the prior N(0, cov)."""
    extension = LawExtension(kind)
    return extend(problem, extension, [(extension.shape, cov)])


def reopen_wind(problem: Problem) -> Problem:
    """Return the problem with the wind as unknown as before calibration."""
    mean, cov, law = np.array(problem.mean), np.array(problem.cov), problem.law
    mean[WIND] = 0.0
    cov[WIND, :] = cov[:, WIND] = 0.0
    cov[WIND, WIND] = np.diag([law.wind_per_m_u**2, law.wind_per_m_u**2, law.lift_per_m_u**2])
    return replace(problem, mean=mean, cov=cov)
