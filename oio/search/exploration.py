"""Exploration before the first belief, or while the plume is lost: optimal search in wind, space filling in still air.

In wind a plume is narrow, and a sniff without gas is evidence against the sources upwind of it. The next sniff has the highest detection
probability per second (optimal search theory, Koopman 1957, Oper. Res. 5:613): a source at s is detected at p with probability
exp(-(|k| r - k.d)), d = p - s, r = |d|, the law's intermittency factor (`oio.gas.range_law`), up to the range REACH_M. In still air gas
is everywhere, and the sniffs fill the space: the pose farthest from all sniffed positions per second (maximin design, Johnson, Moore,
Ylvisaker 1990).
"""

import numpy as np

from oio.core.records import Array
from oio.gas.range_law import WIND
from oio.inference.sampling import halton
from oio.search.view import View

TRIES = 128  # candidate poses
GRID_POINTS = 300  # possible source positions
WINDY_PER_M = 5.0  # U / 2K below this has no reliable direction
REACH_M = 0.4  # detection range: beyond, the plume is diluted
HIT_WEIGHT = 0.5  # factor on the detection probability at each waypoint, the end of the path among them
FALSE_ALARM = 0.02  # probability of a whiff from another origin
DOWNWIND_M = 0.12  # half of the candidates lie at most this far downwind of possible source positions
WAYPOINTS = 4  # points of a path at which detection is evaluated


def explore(view: View, rng: np.random.Generator) -> Array:
    """Return the next joint goal (n,) rad."""
    q_now = view.moves[-1].q if view.moves else view.arm.home
    wind = np.zeros(3) if view.law is None else view.law[WIND]
    wind_speed = float(np.linalg.norm(wind))
    posterior = _source_posterior(view, wind) if wind_speed > WINDY_PER_M else None
    poses = view.arm.random_poses(rng, TRIES)
    if posterior is not None:
        poses = np.concatenate([poses, _downwind(view, posterior, wind / wind_speed, rng)])
    free = view.arm.path_is_free(q_now, poses)
    candidates = poses[free] if np.any(free) else poses
    gain = _separation_m(view, candidates) if posterior is None else _path_hit_probability(view, q_now, candidates, wind) @ posterior
    cost_s = view.arm.duration_s(q_now, candidates) + view.dwell_s
    return np.asarray(candidates[int(np.argmax(gain / cost_s))])


def _separation_m(view: View, q: Array) -> Array:
    """Distance (k,) m of the nose at q (k, n) from the nearest sniffed position."""
    sniffed_m = view.arm.nose(np.array([view.arm.home, *(move.q for move in view.moves)]))
    return np.asarray(np.linalg.norm(view.arm.nose(q)[:, None, :] - sniffed_m[None, :, :], axis=2).min(axis=1))


def _source_grid(view: View) -> Array:
    """Possible source positions (j, 3) m: Halton points in the workspace box."""
    low, high = np.array(view.arm.box_low_m), np.array(view.arm.box_high_m)
    return np.asarray(low + halton(GRID_POINTS) * (high - low))


def _hit_probability(p_m: Array, places_m: Array, wind_per_m: Array) -> Array:
    """Detection probability (k, j) at p (k, 3) m of a source at places (j, 3) m."""
    d = p_m[:, None, :] - places_m[None, :, :]
    r = np.linalg.norm(d, axis=2)
    return np.asarray(HIT_WEIGHT * np.exp(-(np.linalg.norm(wind_per_m) * r - d @ wind_per_m) - (r / REACH_M) ** 2))


def _path_hit_probability(view: View, q_from: Array, q_to: Array, wind_per_m: Array) -> Array:
    """Detection probability (k, j) along the path from q_from (k, n) or (n,) to q_to (k, n), for a source at each grid position."""
    places, miss = _source_grid(view), np.ones((len(q_to), GRID_POINTS))
    for share in np.linspace(0.0, 1.0, WAYPOINTS + 1)[1:]:
        miss *= 1.0 - _hit_probability(view.arm.nose(q_from + share * (q_to - q_from)), places, wind_per_m)
    return 1.0 - miss


def _source_posterior(view: View, wind_per_m: Array) -> Array:
    """Posterior (j,) of the source over the grid, given the moves with and without a whiff."""
    if not view.moves:
        return np.full(GRID_POINTS, 1.0 / GRID_POINTS)
    goals = np.array([view.arm.home, *(move.q for move in view.moves)])
    whiffs = np.array([move.whiff_q is not None for move in view.moves])
    ln = np.sum(np.log(1.0 - (1.0 - FALSE_ALARM) * _path_hit_probability(view, goals[:-1], goals[1:], wind_per_m)[~whiffs]), axis=0)
    whiff_q = [move.whiff_q for move in view.moves if move.whiff_q is not None]
    if whiff_q:
        ln = ln + np.sum(np.log(FALSE_ALARM + _hit_probability(view.arm.nose(np.array(whiff_q)), _source_grid(view), wind_per_m)), axis=0)
    weight = np.exp(ln - np.max(ln))
    return np.asarray(weight / np.sum(weight))


def _downwind(view: View, posterior: Array, wind_direction: Array, rng: np.random.Generator) -> Array:
    """Poses (k, n) with the nose somewhat downwind of positions drawn from the posterior."""
    if view.arm.dof < 3:
        return np.empty((0, view.arm.dof))
    q_now = view.moves[-1].q if view.moves else view.arm.home
    places = _source_grid(view)[rng.choice(GRID_POINTS, TRIES, p=posterior)]
    goals = places + DOWNWIND_M * (rng.random((TRIES, 1)) * wind_direction + 0.3 * rng.standard_normal((TRIES, 3)))
    poses, reached = view.arm.solve_ik_all(goals, np.broadcast_to(q_now, (TRIES, len(q_now))))
    return np.asarray(poses[reached])
