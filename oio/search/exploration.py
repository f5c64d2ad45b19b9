"""Where to sniff while nothing is believed, or the plume is lost.

In wind a plume is narrow, and where it was not smelt tells where the source is not. The next sniff is the one that smells the plume with
the highest chance per second (optimal search, Koopman 1957, Oper. Res. 5:613): a source at s is smelt at p with a chance of
exp(-(|k| r - k.d)), d = p - s, r = |d|, the law's share of time that the plume is there (`oio.gas.range_law`), up to the range REACH_M.
In still air gas is everywhere, and the sniffs spread out: the farthest from all sniffed places for the time it takes (maximin design,
Johnson, Moore, Ylvisaker 1990).
"""

import numpy as np

from oio.core.records import Array
from oio.gas.range_law import WIND
from oio.inference.sampling import halton
from oio.search.view import View

TRIES = 128  # poses of which the best is taken
GRID_POINTS = 300  # where the source may be
WINDY_PER_M = 5.0  # below this U / 2K has no direction to rely on
REACH_M = 0.4  # a plume is diluted beyond
HIT_WEIGHT = 0.5  # of a chance to smell that a place on the way has, and its end
FALSE_ALARM = 0.02  # chance of smelling something else
DOWNWIND_M = 0.12  # half of the poses are so far downwind, at most, of where the source may be
WAYPOINTS = 4  # places on the way that count


def explore(view: View, rng: np.random.Generator) -> Array:
    """The next joint goal (n,) rad."""
    here = view.moves[-1].q if view.moves else view.arm.home
    wind = np.zeros(3) if view.law is None else view.law[WIND]
    speed = float(np.linalg.norm(wind))
    chances = _source_posterior(view, wind) if speed > WINDY_PER_M else None
    poses = view.arm.random_poses(rng, TRIES)
    if chances is not None:
        poses = np.concatenate([poses, _downwind(view, chances, wind / speed, rng)])
    free = view.arm.free(here, poses)
    candidates = poses[free] if np.any(free) else poses
    gain = _separation_m(view, candidates) if chances is None else _miss_probability(view, here, candidates, wind) @ chances
    cost_s = view.arm.duration_s(here, candidates) + view.dwell_s
    return np.asarray(candidates[int(np.argmax(gain / cost_s))])


def _separation_m(view: View, q: Array) -> Array:
    """Distance (k,) m of the nose at q (k, n) from all sniffed places."""
    seen = view.arm.nose(np.array([view.arm.home, *(move.q for move in view.moves)]))
    return np.asarray(np.linalg.norm(view.arm.nose(q)[:, None, :] - seen[None, :, :], axis=2).min(axis=1))


def _source_grid(view: View) -> Array:
    low, high = np.array(view.arm.box_low_m), np.array(view.arm.box_high_m)
    return np.asarray(low + halton(GRID_POINTS) * (high - low))


def _hit_probability(p_m: Array, places_m: Array, wind_per_m: Array) -> Array:
    """Chance (k, j) that a source at places (j, 3) is smelt at p (k, 3)."""
    d = p_m[:, None, :] - places_m[None, :, :]
    r = np.linalg.norm(d, axis=2)
    return np.asarray(HIT_WEIGHT * np.exp(-(np.linalg.norm(wind_per_m) * r - d @ wind_per_m) - (r / REACH_M) ** 2))


def _miss_probability(view: View, q_from: Array, q_to: Array, wind_per_m: Array) -> Array:
    """Chance (k, j) that the way from q_from (k, n) or (n,) to q_to (k, n) smells a source at each of the places."""
    places, nothing = _source_grid(view), np.ones((len(q_to), GRID_POINTS))
    for share in np.linspace(0.0, 1.0, WAYPOINTS + 1)[1:]:
        nothing *= 1.0 - _hit_probability(view.arm.nose(q_from + share * (q_to - q_from)), places, wind_per_m)
    return 1.0 - nothing


def _source_posterior(view: View, wind_per_m: Array) -> Array:
    """Posterior (j,) of the places given what the moves smelt, and did not."""
    if not view.moves:
        return np.full(GRID_POINTS, 1.0 / GRID_POINTS)
    goals = np.array([view.arm.home, *(move.q for move in view.moves)])
    smelt = np.array([move.smelt is not None for move in view.moves])
    ln = np.sum(np.log(1.0 - (1.0 - FALSE_ALARM) * _miss_probability(view, goals[:-1], goals[1:], wind_per_m)[~smelt]), axis=0)
    where = [move.smelt for move in view.moves if move.smelt is not None]
    if where:
        ln = ln + np.sum(np.log(FALSE_ALARM + _hit_probability(view.arm.nose(np.array(where)), _source_grid(view), wind_per_m)), axis=0)
    chance = np.exp(ln - np.max(ln))
    return np.asarray(chance / np.sum(chance))


def _downwind(view: View, chances: Array, towards: Array, rng: np.random.Generator) -> Array:
    """Poses (k, n) with the nose somewhat downwind of where the source may be."""
    if view.arm.dof < 3:
        return np.empty((0, view.arm.dof))
    here = view.moves[-1].q if view.moves else view.arm.home
    places = _source_grid(view)[rng.choice(GRID_POINTS, TRIES, p=chances)]
    goals = places + DOWNWIND_M * (rng.random((TRIES, 1)) * towards + 0.3 * rng.standard_normal((TRIES, 3)))
    poses, there = view.arm.reach_all(goals, np.broadcast_to(here, (TRIES, len(here))))
    return np.asarray(poses[there])
