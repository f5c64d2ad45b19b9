"""What the motion cannot see, in words: directions that the readings do not narrow, and the twin that smells alike.

The rank test scales the information of the whitened readings by the prior's standard deviations; a direction of (source, ln strength) whose
posterior standard deviation is nearly that of the prior was not seen. A nose that stays in a plane leaves the mirror point, and one that
stays on a sphere the inverse point c + R^2 (s - c) / |s - c|^2: whole fields are equal there, which no derivative tells.
"""

import numpy as np

from oio.core.records import Array
from oio.gas.fluctuation import whiten
from oio.gas.range_law import SOURCE
from oio.gas.trace import Sniffs
from oio.inference.belief_map import search_problem
from oio.inference.map_fit import Fit
from oio.inference.prior import Prior
from oio.kinematics.arm import Arm

AXES = ("bearing", "distance", "height", "strength")
NAMED = 0.3  # of an unseen direction of length 1: a smaller part is not named
MOVES_WITH = 0.25  # of the strength's variance: so much of it goes with the direction, and the strength is named too
THIN_M = 0.005  # a path that is thinner lies in a plane (or on a sphere): free play and drift make it as thick

Ambiguity = tuple[str, Array]


def unobservable(sniffs: Sniffs, known: Prior, hypotheses: tuple[Fit, ...], narrowed: float) -> tuple[str, ...]:
    """Sentences for a verdict, none if all was seen; a posterior over prior standard deviation above `narrowed` counts as unseen."""
    best, arm = hypotheses[0], known.model.arm
    told = known.model.law.ln_strength is not None
    ratios, directions, shares = (_of_source if told else _of_both)(*_before_and_after(sniffs, known, best.mean))
    unseen = [_unseen(directions[:3, i], float(shares[i]), arm, told) for i in range(len(ratios)) if ratios[i] > narrowed]
    pair = ambiguous_point(arm.nose(sniffs.q[sniffs.at]), best.source)
    return (*dict.fromkeys(unseen), *_describe_ambiguity(pair, best, arm), *_describe_hypotheses(pair, hypotheses))


def narrowing(sniffs: Sniffs, known: Prior, theta: Array) -> tuple[Array, Array]:
    """Posterior over prior standard deviation (4,), ascending, in directions (columns of (4, 4)) along AXES as seen from the shoulder."""
    return _ratios(*_before_and_after(sniffs, known, theta))


def _of_both(before: Array, after: Array) -> tuple[Array, Array, Array]:
    """`narrowing`, and the share (4,) that each direction has in the strength's variance."""
    ratios, directions = _ratios(before, after)
    part = (ratios * directions[3]) ** 2
    return ratios, directions, part / np.sum(part)


def _of_source(before: Array, after: Array) -> tuple[Array, Array, Array]:
    """The same of the source alone (3,), (3, 3), for a strength that was told is not to be found; the share (3,) is the squared
    correlation of each direction with it: what would be gained if it were told better."""
    ratios, directions = _ratios(before[:3, :3], after[:3, :3])
    with_strength = directions.T @ (after[:3, 3] / np.sqrt(np.diag(before)[:3]))
    return ratios, directions, with_strength**2 / (np.maximum(ratios, 1e-12) ** 2 * after[3, 3])


def _ratios(before: Array, after: Array) -> tuple[Array, Array]:
    spread = np.sqrt(np.diag(before))
    values, directions = np.linalg.eigh(after / np.outer(spread, spread))
    return np.sqrt(np.maximum(values, 0.0)), directions


def _before_and_after(sniffs: Sniffs, known: Prior, theta: Array) -> tuple[Array, Array]:
    """Covariances (4, 4) along AXES, by the prior and with the readings."""
    problem = search_problem(sniffs, known)
    expected, scale = problem.predict(theta), np.sqrt(np.diag(problem.cov))
    rows = whiten(expected.rows, expected.along, known.model.fluctuation).rows * scale
    prior = problem.cov / np.outer(scale, scale)
    posterior = np.outer(scale, scale) * np.linalg.inv(rows.T @ rows + np.linalg.inv(prior))
    turn = _axes(theta[SOURCE] - known.model.arm.shoulder)
    return turn @ problem.cov[:4, :4] @ turn.T, turn @ posterior[:4, :4] @ turn.T


def _axes(d: Array) -> Array:
    """Rows (4, 4): sideways, outwards, up, and ln strength as it stands, for a source at d (3,) m from the shoulder."""
    out = np.array([d[0], d[1], 0.0]) / max(float(np.hypot(d[0], d[1])), 1e-9)
    turn = np.eye(4)
    turn[0, :3], turn[1, :3] = (-out[1], out[0], 0.0), out
    return turn


def _unseen(direction: Array, strength_share: float, arm: Arm, told: bool) -> str:
    names = [axis for axis, part in zip(AXES[:3], direction, strict=True) if abs(part) > NAMED]
    names += ["strength"] if strength_share > MOVES_WITH or not names else []
    tell = "better (range_law.ln_strength_u)" if told else "(range_law.ln_strength and range_law.ln_strength_u)"
    more = f" or tell the strength {tell}" if "strength" in names else ""
    if len(names) == 1:
        return f"{names[0]} cannot be found with dof={arm.dof}: {_remedy(arm)}{more}."
    return f"{', '.join(names[:-1])} and {names[-1]} cannot be told apart with dof={arm.dof}: {_remedy(arm)}{more}."


def _remedy(arm: Arm) -> str:
    higher = [rung for rung in arm.ladder if rung > arm.dof]
    if not higher:
        return "sniff nearer, and at more distances (stage.navigate.max_moves)"
    return f"add {' and '.join(arm.all_names[arm.dof : higher[0]])} (dof={higher[0]})"


def ambiguous_point(noses: Array, source: Array) -> Ambiguity | None:
    """What smells alike because the noses (m, 3) m lie in a plane or on a sphere, and where it is; None if they do not."""
    middle = noses.mean(axis=0)
    _, spread, across = np.linalg.svd(noses - middle, full_matrices=False)
    if spread[2] < THIN_M * np.sqrt(len(noses)):
        return "mirror", source - 2.0 * float((source - middle) @ across[2]) * across[2]
    rows = np.column_stack([2.0 * noses, np.ones(len(noses))])
    centre = np.linalg.lstsq(rows, np.sum(noses**2, axis=1), rcond=None)[0][:3]
    r = np.linalg.norm(noses - centre, axis=1)
    if float(np.std(r)) > THIN_M:
        return None
    d = source - centre
    return "inverse", centre + float(np.mean(r)) ** 2 * d / max(float(d @ d), 1e-12)


def _describe_ambiguity(pair: Ambiguity | None, best: Fit, arm: Arm) -> tuple[str, ...]:
    """The twin, unless it lies within the region of the source itself."""
    if pair is None or np.linalg.norm(pair[1] - best.source) < np.sqrt(np.trace(best.source_cov)):
        return ()
    kind, place = pair
    surface = "the plane" if kind == "mirror" else "the sphere"
    inside = bool(np.all(place >= arm.box_low_m) and np.all(place <= arm.box_high_m))
    ruled = "" if inside else "; that it lies outside the arm's box is all that speaks against it"
    return (f"the {kind} point {_place(place)} on the other side of {surface} of the nose's path smells alike{ruled}: {_remedy(arm)}.",)


def _describe_hypotheses(pair: Ambiguity | None, hypotheses: tuple[Fit, ...]) -> tuple[str, ...]:
    """Every hypothesis beside the best, and whether it is the twin."""
    best, out = hypotheses[0].source, list[str]()
    for other in (fit.source for fit in hypotheses[1:]):
        near = pair is not None and np.linalg.norm(pair[1] - other) < 0.5 * np.linalg.norm(best - other)
        out.append(f"two places fit alike, {_place(best)} and {_place(other)}{f', its {pair[0]} point' if pair and near else ''}.")
    return tuple(out)


def _place(p: Array) -> str:
    return f"({p[0]:.2f}, {p[1]:.2f}, {p[2]:.2f}) m"
