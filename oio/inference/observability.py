"""Observability of the source along the executed path, as sentences: unobservable directions, and ambiguous (mirror, inverse) points.

The rank test scales the Fisher information of the whitened readings by the prior's standard deviations; a direction of (source, ln
strength) whose posterior standard deviation is nearly that of the prior is unobservable. A nose path in a plane leaves the mirror point as
an ambiguity, and one on a sphere the inverse point c + R^2 (s - c) / |s - c|^2: the whole fields are equal, which no derivative shows.
"""

import numpy as np

from oio.core.records import Array
from oio.gas.range_law import SOURCE
from oio.gas.trace import Sniffs
from oio.gas.whitening import whiten
from oio.inference.belief_map import search_problem
from oio.inference.map_fit import Fit
from oio.inference.prior import Prior
from oio.kinematics.arm import Arm

AXES = ("bearing", "distance", "height", "strength")
MIN_COMPONENT = 0.3  # smaller components of an unobservable unit direction are not named
STRENGTH_SHARE = 0.25  # share of the strength's variance along a direction, above which the strength is named too
FLATNESS_M = 0.005  # a thinner path lies in a plane (or on a sphere): backlash and drift account for this thickness

Ambiguity = tuple[str, Array]


def unobservable(sniffs: Sniffs, known: Prior, hypotheses: tuple[Fit, ...], narrowed: float) -> tuple[str, ...]:
    """Sentences for a verdict, none if all is observable; above `narrowed`, posterior over prior standard deviation is unobservable."""
    best, arm = hypotheses[0], known.model.arm
    known_strength = known.model.law.ln_strength is not None
    ratios, directions, shares = (_source_ratios if known_strength else _joint_ratios)(*_prior_and_posterior(sniffs, known, best.mean))
    sentences = [
        _describe_direction(directions[:3, i], float(shares[i]), arm, known_strength) for i in range(len(ratios)) if ratios[i] > narrowed
    ]
    ambiguity = ambiguous_point(arm.nose(sniffs.q[sniffs.at]), best.source)
    return (*dict.fromkeys(sentences), *_describe_ambiguity(ambiguity, best, arm), *_describe_hypotheses(ambiguity, hypotheses))


def posterior_prior_ratio(sniffs: Sniffs, known: Prior, theta: Array) -> tuple[Array, Array]:
    """Ratios of posterior to prior standard deviation (4,), ascending, and directions (columns of (4, 4)) in AXES from the shoulder."""
    return _ratios(*_prior_and_posterior(sniffs, known, theta))


def _joint_ratios(prior: Array, posterior: Array) -> tuple[Array, Array, Array]:
    """`posterior_prior_ratio`, and the share (4,) of the strength's variance along each direction."""
    ratios, directions = _ratios(prior, posterior)
    variance = (ratios * directions[3]) ** 2
    return ratios, directions, variance / np.sum(variance)


def _source_ratios(prior: Array, posterior: Array) -> tuple[Array, Array, Array]:
    """The same for the source alone (3,), (3, 3), if the strength is configured; the share (3,) is the squared correlation of each
    direction with the strength: what a more certain strength would gain."""
    ratios, directions = _ratios(prior[:3, :3], posterior[:3, :3])
    with_strength = directions.T @ (posterior[:3, 3] / np.sqrt(np.diag(prior)[:3]))
    return ratios, directions, with_strength**2 / (np.maximum(ratios, 1e-12) ** 2 * posterior[3, 3])


def _ratios(prior: Array, posterior: Array) -> tuple[Array, Array]:
    sd = np.sqrt(np.diag(prior))
    values, directions = np.linalg.eigh(posterior / np.outer(sd, sd))
    return np.sqrt(np.maximum(values, 0.0)), directions


def _prior_and_posterior(sniffs: Sniffs, known: Prior, theta: Array) -> tuple[Array, Array]:
    """Prior and posterior covariance (4, 4) in AXES."""
    problem = search_problem(sniffs, known)
    expected, scale = problem.predict(theta[: problem.layout.size]), np.sqrt(np.diag(problem.cov))
    rows = whiten(expected.rows, expected.along, known.model.fluctuation).rows * scale
    scaled_prior = problem.cov / np.outer(scale, scale)
    posterior = np.outer(scale, scale) * np.linalg.inv(rows.T @ rows + np.linalg.inv(scaled_prior))
    rotation = _axes_rotation(theta[SOURCE] - known.model.arm.shoulder)
    return rotation @ problem.cov[:4, :4] @ rotation.T, rotation @ posterior[:4, :4] @ rotation.T


def _axes_rotation(d: Array) -> Array:
    """Rotation to AXES (4, 4), rows sideways, outwards, up, and ln strength, for a source at d (3,) [m] from the shoulder."""
    out = np.array([d[0], d[1], 0.0]) / max(float(np.hypot(d[0], d[1])), 1e-9)
    rotation = np.eye(4)
    rotation[0, :3], rotation[1, :3] = (-out[1], out[0], 0.0), out
    return rotation


def _describe_direction(direction: Array, strength_share: float, arm: Arm, strength_known: bool) -> str:
    names = [axis for axis, part in zip(AXES[:3], direction, strict=True) if abs(part) > MIN_COMPONENT]
    names += ["strength"] if strength_share > STRENGTH_SHARE or not names else []
    how = "better (range_law.ln_strength_u)" if strength_known else "(range_law.ln_strength and range_law.ln_strength_u)"
    or_strength = f" or tell the strength {how}" if "strength" in names else ""
    if len(names) == 1:
        return f"{names[0]} cannot be found with dof={arm.dof}: {_remedy(arm)}{or_strength}."
    return f"{', '.join(names[:-1])} and {names[-1]} cannot be told apart with dof={arm.dof}: {_remedy(arm)}{or_strength}."


def _remedy(arm: Arm) -> str:
    higher = [rung for rung in arm.rungs if rung > arm.dof]
    if not higher:
        return "sniff nearer, and at more distances (stage.navigate.max_moves)"
    return f"add {' and '.join(arm.all_names[arm.dof : higher[0]])} (dof={higher[0]})"


def ambiguous_point(noses: Array, source: Array) -> Ambiguity | None:
    """Mirror or inverse point, with equal readings because the nose positions (m, 3) [m] lie in a plane or on a sphere; else None. Two
    positions lie in any plane, and single none out."""
    if len(noses) < 3:
        return None
    mean = noses.mean(axis=0)
    _, singular_values, axes = np.linalg.svd(noses - mean, full_matrices=False)
    if singular_values[2] < FLATNESS_M * np.sqrt(len(noses)):
        return "mirror", source - 2.0 * float((source - mean) @ axes[2]) * axes[2]
    rows = np.column_stack([2.0 * noses, np.ones(len(noses))])
    centre = np.linalg.lstsq(rows, np.sum(noses**2, axis=1), rcond=None)[0][:3]
    r = np.linalg.norm(noses - centre, axis=1)
    if float(np.std(r)) > FLATNESS_M:
        return None
    d = source - centre
    return "inverse", centre + float(np.mean(r)) ** 2 * d / max(float(d @ d), 1e-12)


def _describe_ambiguity(ambiguity: Ambiguity | None, best: Fit, arm: Arm) -> tuple[str, ...]:
    """Sentence on the ambiguous point, unless it lies within the region of the source itself."""
    if ambiguity is None or np.linalg.norm(ambiguity[1] - best.source) < np.sqrt(np.trace(best.source_cov)):
        return ()
    kind, place = ambiguity
    surface = "the plane" if kind == "mirror" else "the sphere"
    inside = bool(np.all(place >= arm.box_low_m) and np.all(place <= arm.box_high_m))
    ruled = "" if inside else "; it is ruled out only by the workspace box"
    return (
        f"the {kind} point {_point(place)} on the other side of {surface} of the nose's path gives equal readings{ruled}: {_remedy(arm)}.",
    )


def _describe_hypotheses(pair: Ambiguity | None, hypotheses: tuple[Fit, ...]) -> tuple[str, ...]:
    """Sentence on every hypothesis besides the best, and whether it is the ambiguous point."""
    best, out = hypotheses[0].source, list[str]()
    for other in (fit.source for fit in hypotheses[1:]):
        near = pair is not None and np.linalg.norm(pair[1] - other) < 0.5 * np.linalg.norm(best - other)
        out.append(f"two places fit alike, {_point(best)} and {_point(other)}{f', its {pair[0]} point' if pair and near else ''}.")
    return tuple(out)


def _point(p: Array) -> str:
    return f"({p[0]:.2f}, {p[1]:.2f}, {p[2]:.2f}) m"
