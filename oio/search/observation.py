"""What a robot knows in the middle of a search, as arrays of fixed shapes between -1 and 1: for policies that are learned.

All of it is computed from a `View`, so nothing of the truth can be in it. Places are isotropic: metres from the middle of the workspace
box over half of its diagonal. Standard deviations are logarithms, signals are inverse hyperbolic sines of standard deviations of a reading.
"""

import numpy as np

from oio.core.records import Array
from oio.gas.range_law import EXPONENT, THINNING, WIND
from oio.search.sniff_history import believed_law, joint_offsets, last_goal
from oio.search.view import Move, View

Observation = dict[str, Array]
HYPOTHESES, SNIFFS = 3, 6  # of a view that are told: the best hypotheses, and the latest moves
LN_SD = 8.0  # a standard deviation of exp(-8) of half of the diagonal, 0.2 mm for the SO-101, is -1; that half itself is 0
ASINH_SIGNAL = 12.0  # a signal of 80 000 standard deviations of a reading is 1
WIND_PER_M = 10.0  # a wind of this U / 2K is 0.5
MANY_MOVES = 200  # so many are 1


def shapes(dof: int) -> dict[str, tuple[int, ...]]:
    """Shapes of an observation of an arm with `dof` joints."""
    return {
        "joints": (dof,), "nose": (3,), "belief": (1,), "source": (3,), "source_sd": (3,), "source_correlation": (3,),
        "hypotheses": (HYPOTHESES, 5), "law": (5,), "sniffs": (SNIFFS, 6), "moves": (1,),
    }  # fmt: skip


def half_diagonal_m(view: View) -> float:
    """Half of the diagonal of the workspace box [m], the unit of places."""
    return 0.5 * float(np.linalg.norm(np.subtract(view.arm.box_high_m, view.arm.box_low_m)))


def observe(view: View) -> Observation:
    """Return the observation of a view, each entry within [-1, 1]: see `shapes`.

    `joints`: of the last goal, over their range. `nose`: believed, there. `belief`: 1, or -1 without one. `source`, `source_sd`,
    `source_correlation` (xy, xz, yz): of the belief, zero without one. `hypotheses`: place, spread and -2 ln of the evidence over that of
    the best, of each; zero if there are fewer. `law`: wind, exponent and thinning believed. `sniffs`: of each of the latest moves, the
    last first: nose, signal, share of bouts, and 1 for a whiff, -1 for clean air throughout, else 0. `moves`: logarithm of their number.
    """
    q, o = last_goal(view), joint_offsets(view)
    span = view.arm.high_rad - view.arm.low_rad
    told = {
        "joints": 2.0 * (q - view.arm.low_rad) / np.where(span > 0.0, span, 1.0) - 1.0,
        "nose": _place(view, view.arm.nose(q - o)),
        "belief": np.array([-1.0 if view.belief is None else 1.0]),
        **_believed(view),
        "hypotheses": _hypotheses(view),
        "law": _law(view),
        "sniffs": _sniffs(view, o),
        "moves": np.array([np.log1p(len(view.moves)) / np.log1p(MANY_MOVES)]),
    }
    return {name: np.clip(np.nan_to_num(value, nan=0.0, posinf=1.0, neginf=-1.0), -1.0, 1.0) for name, value in told.items()}


def _place(view: View, p_m: Array) -> Array:
    """Places (..., 3) in the units of an observation."""
    middle = 0.5 * np.add(view.arm.box_low_m, view.arm.box_high_m)
    return np.asarray((p_m - middle) / half_diagonal_m(view))


def _ln_sd(view: View, sd_m: Array) -> Array:
    return np.log(np.maximum(sd_m, 1e-9) / half_diagonal_m(view)) / LN_SD


def _believed(view: View) -> Observation:
    if view.belief is None:
        return {"source": np.zeros(3), "source_sd": np.zeros(3), "source_correlation": np.zeros(3)}
    s = view.model.at["s"]
    cov = view.belief.cov[s, s]
    sd = np.sqrt(np.maximum(np.diag(cov), 1e-18))
    return {
        "source": _place(view, view.belief.mean[s]),
        "source_sd": _ln_sd(view, sd),
        "source_correlation": (cov / np.outer(sd, sd))[[0, 0, 1], [1, 2, 2]],
    }


def _hypotheses(view: View) -> Array:
    rows = np.zeros((HYPOTHESES, 5))
    for row, fit in zip(rows, view.hypotheses[:HYPOTHESES], strict=False):
        row[:3] = _place(view, fit.source)
        row[3] = _ln_sd(view, np.sqrt(max(float(np.trace(fit.source_cov)), 0.0)))
        row[4] = (fit.minus_2_log_evidence - view.hypotheses[0].minus_2_log_evidence) / 10.0
    return rows


def _law(view: View) -> Array:
    law = believed_law(view)
    wind = law[WIND] / (WIND_PER_M + np.linalg.norm(law[WIND]))
    return np.array([*wind, law[EXPONENT] / 4.0, law[THINNING] / 20.0])


def _sniffs(view: View, offsets: Array) -> Array:
    rows = np.zeros((SNIFFS, 6))
    latest = view.moves[: -SNIFFS - 1 : -1]
    if latest:
        rows[: len(latest), :3] = _place(view, view.arm.nose(np.array([move.q for move in latest]) - offsets))
        rows[: len(latest), 3:] = [_smelt(view, move) for move in latest]
    return rows


def _smelt(view: View, move: Move) -> list[float]:
    heard = 1.0 if move.whiff_q is not None else -1.0 if move.silent else 0.0
    return [float(np.arcsinh(move.ppm / view.model.sigma_ppm)) / ASINH_SIGNAL, move.bouts, heard]
