"""Where to sniff while nothing is believed, or the plume is lost.

In wind a plume is narrow, and where it was not smelt tells where the source is not. The next sniff is the one that smells the plume with
the highest chance per second (optimal search, Koopman 1957, Oper. Res. 5:613): a source at s is smelt at p with a chance of
exp(-(|k| r - k.d)), d = p - s, r = |d|, the law's share of time that the plume is there (`oio.gas.range_law`), up to the range REACH_M.
In still air gas is everywhere, and the sniffs spread out: the farthest from all sniffed places for the time it takes (maximin design,
Johnson, Moore, Ylvisaker 1990).
"""

import numpy as np

from oio.core.records import Array
from oio.inference.sampling import halton
from oio.search.view import View

TRIES = 128  # poses of which the best is taken
PLACES = 300  # where the source may be
WINDY_PER_M = 5.0  # below this U / 2K has no direction to rely on
REACH_M = 0.4  # a plume is diluted beyond
SHARE = 0.5  # of a chance to smell that a place on the way has, and its end
FALSE = 0.02  # chance of smelling something else
DOWNWIND_M = 0.12  # half of the poses are so far downwind, at most, of where the source may be
WAY = 4  # places on the way that count


def scout(view: View, rng: np.random.Generator) -> Array:
    """The next joint goal (n,) rad."""
    here = view.moves[-1].q if view.moves else view.arm.home
    wind = np.zeros(3) if view.law is None else view.law[5:8]
    speed = float(np.linalg.norm(wind))
    chances = _chances(view, wind) if speed > WINDY_PER_M else None
    poses = view.arm.random_poses(rng, TRIES)
    if chances is not None:
        poses = np.concatenate([poses, _downwind(view, chances, wind / speed, rng)])
    free = view.arm.free(here, poses)
    candidates = poses[free] if np.any(free) else poses
    gain = _apart(view, candidates) if chances is None else _missed(view, here, candidates, wind) @ chances
    cost_s = view.arm.duration_s(here, candidates) + view.dwell_s
    return np.asarray(candidates[int(np.argmax(gain / cost_s))])


def _apart(view: View, q: Array) -> Array:
    """Distance (k,) m of the nose at q (k, n) from all sniffed places."""
    seen = view.arm.nose(np.array([view.arm.home, *(move.q for move in view.moves)]))
    return np.asarray(np.linalg.norm(view.arm.nose(q)[:, None, :] - seen[None, :, :], axis=2).min(axis=1))


def _places(view: View) -> Array:
    low, high = np.array(view.arm.box_low_m), np.array(view.arm.box_high_m)
    return np.asarray(low + halton(PLACES) * (high - low))


def _smelling(p_m: Array, places_m: Array, wind_per_m: Array) -> Array:
    """Chance (k, j) that a source at places (j, 3) is smelt at p (k, 3)."""
    d = p_m[:, None, :] - places_m[None, :, :]
    r = np.linalg.norm(d, axis=2)
    return np.asarray(SHARE * np.exp(-(np.linalg.norm(wind_per_m) * r - d @ wind_per_m) - (r / REACH_M) ** 2))


def _missed(view: View, q_from: Array, q_to: Array, wind_per_m: Array) -> Array:
    """Chance (k, j) that the way from q_from (k, n) or (n,) to q_to (k, n) smells a source at each of the places."""
    places, nothing = _places(view), np.ones((len(q_to), PLACES))
    for share in np.linspace(0.0, 1.0, WAY + 1)[1:]:
        nothing *= 1.0 - _smelling(view.arm.nose(q_from + share * (q_to - q_from)), places, wind_per_m)
    return 1.0 - nothing


def _chances(view: View, wind_per_m: Array) -> Array:
    """Posterior (j,) of the places given what the moves smelt, and did not."""
    if not view.moves:
        return np.full(PLACES, 1.0 / PLACES)
    goals = np.array([view.arm.home, *(move.q for move in view.moves)])
    smelt = np.array([move.smelt is not None for move in view.moves])
    ln = np.sum(np.log(1.0 - (1.0 - FALSE) * _missed(view, goals[:-1], goals[1:], wind_per_m)[~smelt]), axis=0)
    where = [move.smelt for move in view.moves if move.smelt is not None]
    if where:
        ln = ln + np.sum(np.log(FALSE + _smelling(view.arm.nose(np.array(where)), _places(view), wind_per_m)), axis=0)
    chance = np.exp(ln - np.max(ln))
    return np.asarray(chance / np.sum(chance))


def _downwind(view: View, chances: Array, towards: Array, rng: np.random.Generator) -> Array:
    """Poses (k, n) with the nose somewhat downwind of where the source may be."""
    if view.arm.dof < 3:
        return np.empty((0, view.arm.dof))
    here = view.moves[-1].q if view.moves else view.arm.home
    places = _places(view)[rng.choice(PLACES, TRIES, p=chances)]
    goals = places + DOWNWIND_M * (rng.random((TRIES, 1)) * towards + 0.3 * rng.standard_normal((TRIES, 3)))
    poses, there = view.arm.reach_all(goals, np.broadcast_to(here, (TRIES, len(here))))
    return np.asarray(poses[there])
