"""The cloud holds the truth as often as it says; a sniff never tells less than nothing; infotaxis sniffs where it tells most."""

import time
from dataclasses import replace

import numpy as np
import pytest

from oio.core.errors import BadInput
from oio.gas.range_law import LAW
from oio.search.infotaxis import expected_information
from oio.search.sniff_history import sniff_history
from oio.search.source_posterior import Likelihood, posterior
from oio.search.view import Move, View


@pytest.fixture(scope="module")
def strategy(built):
    return built("search", "search=infotaxis")


def hits(made, source, strength, moves, seed, quiet=False):
    """A view after random moves, their signals drawn from the law and its fluctuation; the dwell is long, so the lag is over."""
    view, rng = View(made.arm, made.model, None, (), (), dwell_s=20.0, standoff_m=0.0), np.random.default_rng(seed)
    model = replace(made.model, rise_s=0.01, fall_s=0.01)
    view = replace(view, model=model)
    q = np.array([made.arm.random_pose(rng) for _ in range(moves)])
    unit, relative = Likelihood(view, sniff_history(view), 0.0, 1).unit(made.arm.nose(q), source[None], np.zeros(3))
    c = strength * unit[:, 0]
    noise = 0.0 if quiet else c * relative[:, 0] * rng.standard_normal(moves) + model.sigma_ppm * rng.standard_normal(moves)
    return replace(view, moves=tuple(Move(a, 0.0, float(b)) for a, b in zip(q, c + noise, strict=True)))


def inside(likelihood, cloud, source, mass):
    """Whether the region of highest density with so much mass holds the source: the cloud is asked about it as about its own places."""
    _, ln = likelihood.ln(np.vstack([cloud.places_m, source]), cloud.cell_m)
    density = np.sum(np.exp(ln - np.max(ln)), axis=1)
    return np.sum(density[:-1][density[:-1] > density[-1]]) <= mass * np.sum(density[:-1])


@pytest.mark.parametrize(("moves", "model_discrepancy"), [(4, 0.0), (10, 0.0), (10, 0.2)])
def test_the_cloud_holds_the_truth_at_the_95_percent_level(lab, moves, model_discrepancy):
    """Sources are drawn from what the cloud takes for granted: anywhere in the box. Of 60, 57 are expected; 51 are 2.5 sigma fewer."""
    made, held, runs = lab(5), 0, 60
    for seed in range(runs):
        rng = np.random.default_rng([7, seed])
        source = rng.uniform(made.arm.box_low_m, made.arm.box_high_m)
        view = hits(made, source, 20.0 * np.exp(0.3 * rng.standard_normal()), moves, seed)
        likelihood = Likelihood(view, sniff_history(view), model_discrepancy, 5)
        held += inside(likelihood, posterior(likelihood, 400, 3), source, 0.95)
    assert held >= 51


def test_it_is_narrow_about_the_truth_when_the_gas_is_quiet(lab):
    made, source = lab(5), np.array([0.33, 0.1, 0.2])
    view = hits(made, source, 20.0, 20, 1, quiet=True)
    cloud = posterior(Likelihood(view, sniff_history(view), 0.02, 5), 300, 5)
    w = np.sum(cloud.weight, axis=1)
    assert np.linalg.norm(w @ cloud.places_m - source) < 0.01
    assert w @ np.exp(np.mean(cloud.ln_strength, axis=1)) == pytest.approx(20.0, rel=0.1)


def test_units_do_not_matter(lab):
    """A thousand times the gas and the noise is the same cloud."""
    view = hits(lab(3), np.array([0.3, 0.0, 0.2]), 20.0, 6, 2)
    ppb = replace(view, model=replace(view.model, sigma_ppm=1e3 * view.model.sigma_ppm))
    ppb = replace(ppb, moves=tuple(replace(move, ppm=1e3 * move.ppm) for move in view.moves))
    one, other = (posterior(Likelihood(v, sniff_history(v), 0.2, 3), 100, 2) for v in (view, ppb))
    np.testing.assert_allclose(one.places_m, other.places_m, atol=1e-9)
    np.testing.assert_allclose(one.weight, other.weight, atol=1e-9)
    np.testing.assert_allclose(one.ln_strength + np.log(1e3), other.ln_strength, atol=1e-9)


@pytest.mark.parametrize("seed", range(6))
def test_a_sniff_is_never_expected_to_add_entropy_nor_to_take_more_than_there_is(lab, seed):
    rng, made = np.random.default_rng(seed), lab(3)
    view = hits(made, rng.uniform([0.22, -0.2, 0.1], [0.42, 0.2, 0.28]), 20.0, int(rng.integers(1, 12)), seed)
    likelihood = Likelihood(view, sniff_history(view), 0.2, 3)
    cloud = posterior(likelihood, 200, 2)
    w = np.sum(cloud.likeliest(0.999).weight, axis=1)
    noses = made.arm.nose(np.array([made.arm.random_pose(rng) for _ in range(20)]))
    for levels in (2, 5):
        told = expected_information(likelihood, cloud, noses, levels)
        assert np.all(told >= -1e-9) and np.all(told <= min(np.log(levels), -float(w @ np.log(w))) + 1e-9)


def test_more_levels_of_the_same_edges_tell_more(lab):
    """Two levels are four with neighbours joined."""
    view = hits(lab(3), np.array([0.3, 0.0, 0.2]), 20.0, 5, 3)
    likelihood = Likelihood(view, sniff_history(view), 0.2, 3)
    cloud, rng = posterior(likelihood, 200, 2), np.random.default_rng(0)
    noses = view.arm.nose(np.array([view.arm.random_pose(rng) for _ in range(20)]))
    assert np.all(expected_information(likelihood, cloud, noses, 4) >= expected_information(likelihood, cloud, noses, 2) - 1e-9)


def test_likeliest_places_have_the_mass(lab):
    view = hits(lab(3), np.array([0.3, 0.0, 0.2]), 20.0, 5, 3)
    cloud = posterior(Likelihood(view, sniff_history(view), 0.2, 3), 200, 1)
    kept = cloud.likeliest(0.9)
    assert len(kept.places_m) < len(cloud.places_m) and np.sum(kept.weight) == pytest.approx(1.0)
    assert np.sum(np.sort(np.sum(cloud.weight, axis=1))[::-1][: len(kept.places_m)]) >= 0.9


def test_it_sniffs_where_it_tells_more_than_anywhere(lab, strategy):
    made = lab(5)
    view = replace(hits(made, np.array([0.33, 0.1, 0.2]), 20.0, 6, 5), dwell_s=1.0)
    likelihood = Likelihood(view, sniff_history(view), strategy.model_discrepancy, strategy.strengths)
    cloud, rng = posterior(likelihood, strategy.places, strategy.refinements), np.random.default_rng(0)
    chosen, random_candidates = (
        made.arm.nose(np.array(q))
        for q in ([strategy.propose(view, np.random.default_rng(s)) for s in range(8)], [made.arm.random_pose(rng) for _ in range(40)])
    )
    told = [np.mean(expected_information(likelihood, cloud, noses, strategy.levels)) for noses in (chosen, random_candidates)]
    assert told[0] > 1.3 * told[1]


def test_the_calibrated_wind_counts(lab):
    view = hits(lab(3), np.array([0.3, 0.0, 0.2]), 20.0, 5, 3)
    law = np.zeros(LAW)
    law[4:6] = 1.0, 8.0
    still, windy = (posterior(Likelihood(v, sniff_history(v), 0.2, 3), 100, 0).weight for v in (view, replace(view, law=law)))
    assert not np.allclose(still, windy)


def test_a_proposal_takes_less_than_30_ms(lab, strategy):
    view = replace(hits(lab(5), np.array([0.33, 0.1, 0.2]), 20.0, 24, 5), dwell_s=1.0)
    strategy.propose(view, np.random.default_rng(0))  # compiles
    took = []
    for seed in range(10):
        began = time.process_time()
        strategy.propose(view, np.random.default_rng(seed))
        took.append(time.process_time() - began)
    assert min(took) < 0.03


@pytest.mark.parametrize(("key", "value"), [("places", 1), ("levels", 1), ("model_discrepancy", -1.0), ("random_candidates", 0)])
def test_senseless_settings_are_refused(strategy, key, value):
    with pytest.raises(BadInput, match=key):
        replace(strategy, **{key: value})


def test_a_strength_that_was_told_is_that_of_the_cloud(lab):
    """Where the signals say little, they do not pull it away."""
    view = hits(lab(3), np.array([0.3, 0.0, 0.2]), 20.0, 2, 2)
    told = replace(view, model=replace(view.model, law=replace(view.model.law, ln_strength=float(np.log(20.0)), ln_strength_u=0.05)))
    cloud = posterior(Likelihood(told, sniff_history(told), 0.2, 3), 100, 2)
    assert np.sum(cloud.weight * cloud.ln_strength) == pytest.approx(np.log(20.0), abs=0.1)
