"""Sniff history: nose position and settled signal of every move so far, and the range law, by the current belief; none of it is stored.

Positions are those of the believed nose p(q - o), with the joint offsets o of the belief, zero before there is one.
"""

from dataclasses import dataclass

import numpy as np

from oio.core.records import Array
from oio.gas.range_law import EXPONENT, LAW
from oio.search.view import View

MAX_LAG_SHARE = 0.75  # largest share of a change held back by the lag that is corrected for; beyond, noise would be amplified


@dataclass(frozen=True, slots=True, eq=False)
class SniffHistory:
    """Moves with a signal: joints (k, n) rad, believed nose (k, 3) m, settled signal (k,) ppm, and that of each of two elements over its
    gain (k, 2) ppm, NaN where there are not two."""

    q: Array
    p_m: Array
    ppm: Array
    pair_ppm: Array


def joint_offsets(view: View) -> Array:
    """Return the believed joint offsets (n,) rad; zero before the first belief."""
    return np.zeros(view.arm.dof) if view.belief is None else view.belief.mean[view.model.at["o"]]


def believed_law(view: View) -> Array:
    """Return theta (LAW,) of the range law: the belief's, else the calibrated one, else the nominal one of still air."""
    if view.belief is not None:
        s = view.model.at["s"].start
        return np.array(view.belief.mean[s : s + LAW])
    if view.law is not None:
        return np.array(view.law)
    theta = np.zeros(LAW)
    theta[EXPONENT] = view.model.law.exponent
    return theta


def last_goal(view: View) -> Array:
    """Return the last joint goal (n,) rad."""
    return view.moves[-1].q if view.moves else view.arm.home


def goals(view: View) -> Array:
    """Return all joint goals: home, then the goal of every move (k + 1, n) rad."""
    return np.array([view.arm.home, *(move.q for move in view.moves)])


def sniff_history(view: View) -> SniffHistory:
    """Return all moves that lasted long enough for a signal (else it is 0), corrected for the first-order lag.

    f_i = phi f_{i-1} + (1 - phi) c_i over the dwell and half of the travel time gives c_i.
    """
    q, f = goals(view), np.array([move.ppm for move in view.moves])
    measured = np.flatnonzero(f != 0.0)
    nose_m = view.arm.nose(q[1:][measured] - joint_offsets(view))
    return SniffHistory(q[1:][measured], nose_m, _settled(view, q, f)[measured], _settled_pair(view, q)[measured])


def _settled(view: View, q: Array, f: Array) -> Array:
    """Settled signal (k,) of signals f (k,) at the ends of moves between goals q (k + 1, n)."""
    phi = np.array([_lag_share(view, q[i], q[i + 1], i > 0 and f[i] > f[i - 1]) for i in range(len(f))])
    previous = np.concatenate([f[:1], f[:-1]])
    return np.asarray(f + phi / (1.0 - phi) * np.where(previous != 0.0, f - previous, 0.0))


def _settled_pair(view: View, q: Array) -> Array:
    signals = np.array([move.element_ppm if len(move.element_ppm) == 2 else (np.nan, np.nan) for move in view.moves]).reshape(-1, 2)
    if view.arm.spacing_m == 0.0 or len(view.model.gain) != 2:
        return np.full(signals.shape, np.nan)
    return np.column_stack([_settled(view, q, column) for column in signals.T]) / view.model.gain


def _lag_share(view: View, q_from: Array, q_to: Array, rising: bool) -> float:
    """phi: share of a change that the first-order lag still holds back at the end of a dwell, at most MAX_LAG_SHARE."""
    time_s = view.dwell_s + 0.5 * view.arm.duration_s(q_from, q_to)
    return min(float(np.exp(-time_s / (view.model.rise_s if rising else view.model.fall_s))), MAX_LAG_SHARE)
