"""Elements at two places: Jacobians, the compiled step and the whitening against plain ones; at one place all is as it was, to the bit."""

from dataclasses import replace

import numpy as np
import pytest

from oio.core.records import Belief, GasReading, JointState, nanoseconds
from oio.estimators.propagation import LinearizedStep, add_process_noise, predict
from oio.gas.fluctuation import Fluctuation, SecondPlace
from oio.gas.source_shape import POINT_SOURCE, TWO, SourceShape
from oio.gas.whitening import whiten
from oio.inference.likelihoods import fit_fluctuation
from oio.inference.map_fit import solve
from oio.inference.rise_and_fall import by_ln_fall

NOISE = Fluctuation(1.0, 0.2, 0.3)
APART = {"element_spacing_m": 0.06}
SKEWED = {"element_places_m": ((0.01, 0.02, 0.0), (-0.02, 0.0, 0.03))}


def placed(made, **places):
    """The lab with its elements elsewhere."""
    made.arm = replace(made.arm, **places)
    made.model = replace(made.model, arm=made.arm)
    return made


def state(made, seed=0):
    rng, at, x = np.random.default_rng(seed), made.model.at, np.zeros(made.model.size)
    x[at["o"]], x[at["v"]], x[at["a"]] = (scale * rng.standard_normal(made.arm.dof) for scale in (1e-2, 1e-3, 1e-4))
    x[at["s"].start : at["b"].start] = made.theta()[:9]
    x[at["b"]], x[at["f"]], x[at["m"]] = 0.3, rng.uniform(0.5, 5.0, made.model.places), 0.1 * rng.standard_normal(made.model.places)
    return x


def joints(made, t_s=0.3):
    n = made.arm.dof
    return JointState(nanoseconds(t_s), made.arm.home + 0.1, np.full(n, 0.3), np.zeros(n))


def difference(f, x, h):
    return np.column_stack([(f(x + h * e) - f(x - h * e)) / (2 * h) for e in np.eye(len(x))])


@pytest.mark.parametrize("dof", [3, 5])
@pytest.mark.parametrize("places", [APART, SKEWED])
@pytest.mark.parametrize("shape", [POINT_SOURCE, SourceShape.of(TWO, np.array([0.35, -0.1, 0.2, -0.3]))])
def test_the_filters_jacobian_is_the_central_difference(lab, dof, places, shape):
    made = placed(lab(dof, 2, seed=dof), **places)
    model, x = replace(made.model, shape=shape), state(made)
    x[model.at["m"]] = 0.0
    numeric = difference(lambda y: model.transition(y, 0.3, joints(made))[0], x, 1e-6)
    np.testing.assert_allclose(model.transition(x, 0.3, joints(made))[1], numeric, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("seed", range(3))
def test_the_compiled_step_is_the_models(lab, seed):
    made, rng = placed(lab(5, 2, seed), **(SKEWED if seed else APART)), np.random.default_rng(seed)
    model, x, sensed = made.model, state(made, seed), joints(made)
    root = rng.standard_normal((model.size, model.size))
    cov = root @ root.T
    mean, f, q = model.transition(x, 0.3, sensed)
    after, step = predict(model, Belief(0, x, cov), sensed), LinearizedStep.of(model, x, 0.3, sensed)
    np.testing.assert_allclose(after.mean, mean, rtol=1e-12)
    np.testing.assert_allclose(after.cov, f @ cov @ f.T + q, rtol=1e-9, atol=1e-9)
    np.testing.assert_array_equal(after.cov, after.cov.T)
    np.testing.assert_allclose(step.back(x), f.T @ x, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(add_process_noise(model, x, np.zeros_like(cov), 0.3, sensed), q, rtol=1e-12, atol=1e-30)
    assert np.all(np.linalg.eigvalsh(q[model.at["f"].start :, model.at["f"].start :]) >= -1e-12)


def test_two_half_steps_add_the_noise_of_one(lab):
    made = placed(lab(5, 2, 6), **APART)
    walks = {name: 0.0 for name in ("strength_sqrt_s", "exponent_sqrt_s", "wind_per_m_sqrt_s", "offset_deg_sqrt_s")}
    model, x = replace(made.model, process_noise=replace(made.process_noise, **walks)), state(made)
    x[: 3 * made.arm.dof] = 0.0
    still = replace(joints(made), dq=np.zeros(made.arm.dof))
    start = Belief(0, x, np.zeros((model.size, model.size)))
    once = predict(model, start, still)
    twice = predict(model, predict(model, start, replace(still, t_ns=still.t_ns // 2)), still)
    gas = slice(model.at["f"].start, None)
    np.testing.assert_allclose(twice.cov[gas, gas], once.cov[gas, gas], rtol=1e-6)


def test_a_reading_tells_its_own_place(lab):
    model = placed(lab(3, 2), **APART).model
    rows = [model.measurement(np.arange(float(model.size)), GasReading(0, e, 1.0, 0.05))[1] for e in (0, 1)]
    f, b = model.at["f"].start, model.at["b"].start
    assert [np.flatnonzero(row).tolist() for row in rows] == [[b, f], [b + 1, f + 1]]
    assert model.names[f:] == ("lagged_0", "lagged_1", "fluctuation_0", "fluctuation_1") and len(model.units) == model.size


@pytest.mark.parametrize("places", [APART, SKEWED])
def test_the_fits_jacobian_is_the_central_difference(lab, places):
    made = placed(lab(5, 2, seed=4), **places)
    theta = made.theta()
    problem = made.problem(theta, quiet=True)
    start = theta + 1e-3 * np.sqrt(np.diag(made.cov))
    whole = lambda t: problem.predict(t).ppm + t[problem.layout.baseline][problem.sniffs.element]  # noqa: E731
    steps = zip(np.eye(len(start)), np.maximum(1e-6, 1e-6 * np.abs(start)), strict=True)
    numeric = np.column_stack([(whole(start + h * e) - whole(start - h * e)) / (2 * h) for e, h in steps])
    rows = problem.predict(start).rows
    scale = np.max(np.abs(rows), axis=0) + 1e-9
    assert np.quantile(np.abs(rows - numeric) / scale, 0.99) < 1e-4  # where the lag turns from rise to fall, readings leap


def test_the_difference_of_the_pair_is_that_of_the_places(lab):
    """Standing still for long, each element tells the concentration at its own place."""
    made = placed(lab(5, 2, seed=4), **APART)
    theta = made.theta()
    problem = made.problem(theta, poses=2, stay_s=20.0, quiet=True)
    lay = problem.layout
    theta[lay.drift] = 0.0
    places, _ = made.arm.element_jacobians(problem.sniffs.q[-1:] - theta[lay.offset], 2)
    expected = problem.predict(theta)
    settled = {int(e): expected.ppm[problem.sniffs.element == e][-1] / np.exp(theta[lay.gain][e]) for e in (0, 1)}
    there = [float(f.mean_ppm[-1]) for f in (expected.along.field, expected.along.second.field)]
    np.testing.assert_allclose([settled[0], settled[1]], there, rtol=1e-3)
    assert abs(np.log(there[0] / there[1])) > 0.02 and np.linalg.norm(places[0] - places[1]) == pytest.approx(0.06)


def test_elements_at_one_other_place_are_a_nose_that_is_there(lab, built):
    """Same numbers as of an arm whose nose has that offset; and with zero offsets, those of the arm as it was, to the bit."""
    at = (0.01, -0.02, 0.005)
    plain = lab(3, 2, seed=7)
    theta = plain.theta()
    problem = plain.problem(theta)
    zero = replace(problem, arm=replace(plain.arm, element_places_m=((0.0,) * 3, (0.0,) * 3), element_spacing_m=0.0))
    assert problem.predict(theta).ppm.tobytes() == zero.predict(theta).ppm.tobytes()
    both = replace(problem, arm=replace(plain.arm, element_places_m=(at, at)))
    model = plain.arm.model
    moved = replace(plain.arm)
    shifted = replace(model, nose_offset=model.nose_offset + model.nose_rotation @ np.array(at))
    moved.__dict__["model"] = shifted  # what the arm would have read from a file with that site
    there = replace(problem, arm=moved)
    np.testing.assert_allclose(both.predict(theta).ppm, there.predict(theta).ppm, rtol=1e-12)
    np.testing.assert_allclose(both.predict(theta).rows, there.predict(theta).rows, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(both.nose(theta), there.nose(theta), rtol=1e-12)


def test_a_fit_finds_the_source_and_a_grid_costs_what_the_fit_expects(lab):
    made = placed(lab(5, 2, seed=3), **APART)
    theta = made.theta()
    problem = made.problem(theta)
    fit = solve(problem, theta, NOISE)
    miss = fit.source - theta[:3]
    assert miss @ np.linalg.solve(fit.source_cov, miss) < 16.3 and len(fit.lagged_ppm_at) == 2
    quiet = made.problem(theta, quiet=True)
    left, weight = np.zeros(len(quiet.sniffs.at)), np.ones(len(quiet.sniffs.at))
    costs, ln_factor = quiet.grid_costs(np.array([theta, theta + 0.05 * np.eye(len(theta))[0]]), left, quiet.expect(theta), weight)
    assert costs[0] < 1e-12 * np.sum(quiet.expect(theta) ** 2) < costs[1] and abs(ln_factor[0]) < 1e-6


def pair(made, problem, theta, spacing_m):
    along = problem.predict(theta, False).along
    return replace(along, second=replace(along.second, spacing_m=spacing_m))


def test_far_apart_the_whitening_is_that_of_each_alone(lab):
    made = placed(lab(3, 2, seed=5), **APART)
    theta = made.theta()
    problem = made.problem(theta)
    along, rows = pair(made, problem, theta, 1e3), np.random.default_rng(0).standard_normal((len(problem.sniffs.at), 3))
    white = whiten(rows, along, NOISE)
    second = along.second
    for here, field, tau in ((~second.is_second, along.field, along.tau_s), (second.is_second, second.field, second.tau_s)):
        at = along.at[here]
        alone = replace(along, field=field, tau_s=tau, at=at, gain=along.gain[here], variance_ppm2=along.variance_ppm2[here], second=None)
        np.testing.assert_allclose(white.rows[here], whiten(rows[here], alone, NOISE).rows, rtol=1e-9, atol=1e-12)


def test_the_implied_covariance_of_a_pair_is_that_of_the_process(lab):
    """Without lag: gain^2 swing swing' gamma^2 rho keep^|i - j|, rho = exp(-d / r) between the places and 1 at either."""
    m, swing, keep, rho = 14, (10.0, 7.0), np.exp(-0.1 / 0.5), np.exp(-0.05 / 0.1)
    made = placed(lab(3, 2, seed=5), **APART)
    theta = made.theta()
    field = made.problem(theta).predict(theta, False).along.field
    fields = [
        replace(
            field,
            mean_ppm=np.full(m, s),
            rarity=np.ones(m),
            r_m=np.full(m, 0.1),
            speed_m_s=np.zeros(m),
            slope_m=0.0,
            model_discrepancy=0.0,
            by_wind_m=np.zeros((m, 3)),
        )
        for s in swing
    ]
    is_second, at = np.arange(m) % 2 == 1, np.arange(m)
    along = replace(
        made.problem(theta).predict(theta, False).along, field=fields[0], dt_s=np.where(at > 0, 0.1, 0.0), tau_s=np.full(m, 1e-9), at=at,
        gain=np.full(m, 1.5), variance_ppm2=np.full(m, 0.09), second=SecondPlace(fields[1], np.full(m, 1e-9), is_second, 0.05),
    )  # fmt: skip
    noise = Fluctuation(2.0, 0.4, 0.5)
    lower = np.linalg.inv(whiten(np.eye(m), along, noise).rows[2:, 2:])
    amplitude, i = 1.5 * 0.4 * np.where(is_second, swing[1], swing[0]), at[:, None]
    same = np.where(is_second[:, None] == is_second, 1.0, rho)
    dense = np.outer(amplitude, amplitude) * same * keep ** np.abs(i - at) + 2.0 * 0.09 * np.eye(m)
    np.testing.assert_allclose(lower @ lower.T, dense[2:, 2:], rtol=1e-6)
    residual = np.linalg.cholesky(dense) @ np.random.default_rng(0).standard_normal(m)
    assert fit_fluctuation(residual, along, noise).gamma > 0.0


def test_the_derivative_by_the_fall_is_that_of_each_place(lab):
    made = placed(lab(5, 2, seed=4), **APART)
    theta = made.theta()
    problem = made.problem(theta, quiet=True)
    h, there = 1e-5, by_ln_fall(problem, theta, problem.predict(theta))
    up, down = (replace(problem, fall_s=problem.fall_s * np.exp(s)).predict(theta).ppm for s in (h, -h))
    assert np.quantile(np.abs(there - (up - down) / (2 * h)), 0.95) < 1e-3 * np.max(np.abs(there))
