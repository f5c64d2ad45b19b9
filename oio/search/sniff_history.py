"""What was sniffed where so far, and the range law, by all that is believed; none of it is kept between moves.

Places are those of the believed nose p(q - o), o the joint offsets of the belief, none before there is one.
"""

from dataclasses import dataclass

import numpy as np

from oio.core.records import Array
from oio.gas.range_law import EXPONENT, LAW
from oio.search.view import View

MAX_LAG_SHARE = 0.75  # of a change of the gas may be made up for when the lag holds it back; beyond, noise would be blown up


@dataclass(frozen=True, slots=True, eq=False)
class SniffHistory:
    """Moves that measured something: joints (k, n) rad, believed nose (k, 3) m, settled signal (k,) ppm."""

    q: Array
    p_m: Array
    ppm: Array


def joint_offsets(view: View) -> Array:
    """Believed joint offsets (n,) rad."""
    return np.zeros(view.arm.dof) if view.belief is None else view.belief.mean[view.model.at["o"]]


def believed_law(view: View) -> Array:
    """theta (LAW,) of the range law: the belief's, else the calibrated one, else the nominal one of still air."""
    if view.belief is not None:
        s = view.model.at["s"].start
        return np.array(view.belief.mean[s : s + LAW])
    if view.law is not None:
        return np.array(view.law)
    theta = np.zeros(LAW)
    theta[EXPONENT] = view.model.law.exponent
    return theta


def last_goal(view: View) -> Array:
    """Where the arm was sent last (n,) rad."""
    return view.moves[-1].q if view.moves else view.arm.home


def goals(view: View) -> Array:
    """Where the arm was sent: home, then the goal of every move (k + 1, n) rad."""
    return np.array([view.arm.home, *(move.q for move in view.moves)])


def sniff_history(view: View) -> SniffHistory:
    """All moves that lasted long enough for a signal (else it is 0), with what the lag held back made up for.

    f_i = phi f_{i-1} + (1 - phi) c_i over the dwell and half of the way gives c_i.
    """
    q, f = goals(view), np.array([move.ppm for move in view.moves])
    held = np.array([_lag_share(view, q[i], q[i + 1], i > 0 and f[i] > f[i - 1]) for i in range(len(f))])
    before = np.concatenate([f[:1], f[:-1]])
    settled = f + held / (1.0 - held) * np.where(before != 0.0, f - before, 0.0)
    known = np.flatnonzero(f != 0.0)
    return SniffHistory(q[1:][known], view.arm.nose(q[1:][known] - joint_offsets(view)), settled[known])


def _lag_share(view: View, q_from: Array, q_to: Array, rising: bool) -> float:
    time_s = view.dwell_s + 0.5 * view.arm.duration_s(q_from, q_to)
    return min(float(np.exp(-time_s / (view.model.rise_s if rising else view.model.fall_s))), MAX_LAG_SHARE)
