"""What a motion cannot see is said in words, and nothing is said of a motion that sees everything."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oio.gas.fluctuation import Fluctuation
from oio.gas.range_law import concentration
from oio.inference.belief_map import search_problem
from oio.inference.map_fit import solve
from oio.inference.observability import ambiguous_point, posterior_prior_ratio, unobservable
from oio.kinematics.minimum_jerk import minimum_jerk

NARROWED = 0.7


def searched(lab, built, dof, seed, poses=10):
    made = lab(dof, 1, seed=seed)
    theta = made.theta()
    sniffs = made.problem(theta, poses=poses).sniffs
    return made, theta, sniffs, built("belief_map").locate(sniffs, made.known)


def said(lab, built, dof, seed, poses=10):
    made, _, sniffs, hypotheses = searched(lab, built, dof, seed, poses)
    return unobservable(sniffs, made.known, hypotheses, NARROWED)


@pytest.mark.parametrize("seed", [40, 41, 42, 43, 44])
def test_one_joint_says_distance_and_the_other_side_of_its_plane(lab, built, seed):
    """An arc leaves a curve that goes through its plane: the mirror point is named, unless the source's own region reaches that far."""
    made, _, sniffs, hypotheses = searched(lab, built, 1, seed)
    sentences, best = unobservable(sniffs, made.known, hypotheses, NARROWED), hypotheses[0]
    assert any("distance" in s and "with dof=1: add shoulder_elevation (dof=2)" in s for s in sentences), sentences
    kind, mirror = ambiguous_point(made.arm.nose(sniffs.q[sniffs.at]), best.mean[:3])
    beyond = np.linalg.norm(mirror - best.mean[:3]) > np.sqrt(np.trace(best.cov[:3, :3]))
    told = any(s.startswith("the mirror point (") and "the plane of the nose's path" in s for s in sentences)
    assert kind == "mirror" and told == beyond, sentences
    assert told or any("height" in s for s in sentences), sentences


@pytest.mark.parametrize("seed", [41, 42, 43])
def test_two_joints_say_the_inverse_point(lab, built, seed):
    sentences = said(lab, built, 2, seed)
    assert any("inverse point" in s and "(dof=3)" in s for s in sentences), sentences


@pytest.mark.parametrize("dof", [3, 5])
@pytest.mark.parametrize("seed", [40, 41, 42])
def test_more_joints_see_all(lab, built, dof, seed):
    made, _, sniffs, hypotheses = searched(lab, built, dof, seed)
    sentences = unobservable(sniffs, made.known, hypotheses, NARROWED)
    assert len(sentences) == len(hypotheses) - 1, sentences


def test_hypotheses_that_are_left_are_named(lab, built):
    made, _, sniffs, hypotheses = searched(lab, built, 3, 40)
    other = type(hypotheses[0])(*[getattr(hypotheses[0], name) for name in hypotheses[0].__slots__])
    sentences = unobservable(sniffs, made.known, (hypotheses[0], other), NARROWED)
    assert len(sentences) == 1 and sentences[0].startswith("two places fit alike, (") and "point" not in sentences[0]


@pytest.mark.parametrize("dof", [3, 5])
def test_a_few_sniffs_at_one_place_cannot_tell_distance_from_strength(lab, built, dof):
    made, _, sniffs, hypotheses = searched(lab, built, dof, 44, poses=1)
    sentences = unobservable(sniffs.between(1.2, 2.0), made.known, hypotheses, NARROWED)
    assert any("cannot be told apart" in s or "cannot be found" in s for s in sentences), sentences


@pytest.mark.parametrize("dof", [1, 2, 3, 5])
def test_readings_never_widen_and_directions_are_of_length_one(lab, built, dof):
    made, theta, sniffs, _ = searched(lab, built, dof, 45, poses=6)
    ratios, directions = posterior_prior_ratio(sniffs, made.known, theta)
    assert np.all(np.diff(ratios) >= 0) and np.all(ratios > 0) and ratios[-1] < 1.2  # the box is turned, not round
    np.testing.assert_allclose(directions.T @ directions, np.eye(4), atol=1e-9)


def test_more_readings_narrow_more(lab, built):
    made, theta, sniffs, _ = searched(lab, built, 3, 46, poses=12)
    whole, half = (posterior_prior_ratio(s, made.known, theta)[0] for s in (sniffs, sniffs.between(0.0, 12.0)))
    assert np.all(whole <= half * (1 + 1e-9))


axes = st.floats(-0.9, 0.9)


@given(st.integers(0, 2**32 - 1), st.tuples(axes, axes, axes).map(np.array))
def test_the_twin_smells_alike_wherever_the_nose_has_been(seed, source):
    """In still air: the mirror point as strong, the inverse point R / |s - c| times as strong."""
    rng = np.random.default_rng(seed)
    ray = rng.standard_normal((12, 3))
    on_sphere = np.array([0.1, 0.0, 0.2]) + 0.3 * ray / np.linalg.norm(ray, axis=1)[:, None]
    flat = rng.uniform(-0.3, 0.3, (12, 2)) @ rng.standard_normal((2, 3)) + 0.1
    for noses, kind in ((flat, "mirror"), (on_sphere, "inverse")):
        found = ambiguous_point(noses, source)
        assert found is not None and found[0] == kind
        if min(np.min(np.linalg.norm(noses - p, axis=1)) for p in (source, found[1])) < 0.03:
            continue  # the radius of a source removes the pole, and is not mirrored
        theirs = [np.log(concentration(noses, np.array([*p, 0.0, 1.0, *[0.0] * 4]), 0.1, 1e-6)[0]) for p in (source, found[1])]
        assert np.ptp(theirs[0] - theirs[1]) < 1e-3


def test_a_nose_that_goes_everywhere_leaves_no_twin():
    assert ambiguous_point(np.random.default_rng(0).uniform(-0.3, 0.3, (20, 3)), np.array([0.3, 0.1, 0.2])) is None


def tell(made, ln_strength, u):
    made.law = replace(made.law, ln_strength=float(ln_strength), ln_strength_u=u)
    made.model = replace(made.model, law=made.law)


@pytest.mark.parametrize("dof", [3, 5])
@pytest.mark.parametrize("seed", [40, 41, 42, 44])
def test_the_strength_is_no_blind_spot_any_more_once_it_is_told(lab, built, dof, seed):
    """After a few sniffs at one place; the advice names both keys, or the one that is left to be told better."""
    made, theta, sniffs, _ = searched(lab, built, dof, seed, poses=3)
    sniffs, said = sniffs.between(1.2, 2.0), []
    for u in (None, 2.0, 0.05):
        if u is not None:
            tell(made, theta[3], u)
        said.append(unobservable(sniffs, made.known, built("belief_map").locate(sniffs, made.known), NARROWED))
    untold, hardly, well = ([s for s in sentences if "cannot be" in s] for sentences in said)
    assert any(
        "strength cannot be" in s and "tell the strength (range_law.ln_strength and range_law.ln_strength_u)" in s for s in untold
    ), untold
    assert any("strength cannot be" in s and "tell the strength better (range_law.ln_strength_u)" in s for s in hardly), hardly
    assert not any("strength" in s for s in well) and len(well) < len(untold), well


def huddled(made, poses=6, swing_rad=0.03):
    """Readings of a nose that stays about home: near and weak or far and strong smell nearly alike."""
    made.law = replace(made.law, nose_jitter_m=1e-3, model_discrepancy=0.02)
    made.model = replace(made.model, law=made.law, fluctuation=Fluctuation(1.0, 0.05, 0.3))
    theta = made.theta()
    goals = made.arm.home + made.rng.uniform(-swing_rad, swing_rad, (poses + 1, made.arm.dof))

    def path(poses, stay_s, source):
        t = np.arange(0.0, poses * (1.0 + stay_s), 0.05)
        leg = np.minimum((t / (1.0 + stay_s)).astype(int), poses - 1)
        share = np.array([minimum_jerk(x) for x in t - leg * (1.0 + stay_s)])[:, None]
        return t, goals[leg] + share * (goals[leg + 1] - goals[leg])

    made.path = path
    return theta, made.problem(theta, poses=poses, noise=made.model.fluctuation).sniffs


def test_the_source_is_nearer_once_its_strength_is_told(lab):
    """Where distance goes with strength: in every search, and by a quarter in all."""
    missed = []
    for seed in range(60, 72):
        made = lab(5, 1, seed=seed)
        theta, sniffs = huddled(made)
        untold = solve(search_problem(sniffs, made.known), theta, made.model.fluctuation)
        tell(made, theta[3], 0.05)
        told = solve(search_problem(sniffs, made.known), theta, made.model.fluctuation)
        missed.append([np.linalg.norm(fit.mean[:3] - theta[:3]) for fit in (untold, told)])
    before, after = np.array(missed).T
    assert np.all(after < before) and np.sqrt(np.mean(after**2)) < 0.75 * np.sqrt(np.mean(before**2)), missed
