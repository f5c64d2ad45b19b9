"""The compiled forward model against a plain one (poses, the law in arrays, the lag step by step), and links against poses."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from oio.gas.range_law import LAW, concentration
from oio.inference.belief_map import search_problem
from oio.inference.extension_kernel import LawScale
from oio.inference.forward_kernel import Lag, SensedPath, lag_step, predict_readings
from oio.inference.law_extension import UNEXTENDED
from oio.kinematics.adjoint import BLOCK, ROWS, adjoint_chain, forward_positions, gradient_by_joints
from oio.kinematics.forward import HINGE, SLIDE, SerialChain, nose_and_jacobian


def lagged(c, dc, dt, rise, fall, f0):
    """f (k,), its sensitivities (k, w), that to ln(tau) (k,), and tau (k,): see `oio.inference.forward_kernel`."""
    f, df, df_tau, used = np.empty(len(c)), np.empty(dc.shape), np.empty(len(c)), np.empty(len(c))
    state, sensitivity, to_tau = f0, np.zeros(dc.shape[1]), 0.0
    for i in range(len(c)):
        before, tau = max(i - 1, 0), rise if c[i] > state else fall
        x = max(dt[i], 1e-9) / tau
        phi = np.exp(-x)
        share = (1.0 - phi) / x if x > 1e-6 else 1.0 - 0.5 * x
        w1, w0 = 1.0 - share, share - phi
        to_tau = phi * to_tau + state * phi * x - c[i] * w0 + c[before] * (w0 - phi * x)
        state = phi * state + w0 * c[before] + w1 * c[i]
        sensitivity = phi * sensitivity + w0 * dc[before] + w1 * dc[i]
        f[i], df[i], df_tau[i], used[i] = state, sensitivity, to_tau, tau
    return f, df, df_tau, used


def floats(low, high):
    return st.floats(low, high, allow_nan=False)


signals = st.lists(floats(0.1, 100.0), min_size=3, max_size=20).map(np.array)


@settings(deadline=None)
@given(signals, floats(0.05, 5.0), floats(0.05, 5.0), st.integers(0, 2**32 - 1))
def test_sensitivities_of_the_lag_are_central_differences(c, rise, fall, seed):
    rng, h = np.random.default_rng(seed), 1e-6
    dc, dt = rng.standard_normal((len(c), 2)), rng.uniform(0.01, 1.0, len(c))
    f, df, df_tau, _ = lagged(c, dc, dt, rise, fall, 0.0)
    assume(np.min(np.abs(c[1:] - f[:-1])) > 1e-3)  # no kink between rise and fall nearby
    for j in range(2):
        up, down = (lagged(c + sign * h * dc[:, j], dc, dt, rise, fall, 0.0)[0] for sign in (1, -1))
        np.testing.assert_allclose(df[:, j], (up - down) / (2 * h), atol=1e-5)
    up, down = (lagged(c, dc, dt, rise * np.exp(s), fall * np.exp(s), 0.0)[0] for s in (h, -h))
    np.testing.assert_allclose(df_tau, (up - down) / (2 * h), atol=1e-4)


@settings(deadline=None, max_examples=20)
@given(signals, floats(0.1, 5.0), floats(0.0, 50.0))
def test_the_lag_is_exact_for_a_signal_that_is_linear_in_every_step(c, tau, f0):
    dt = np.full(len(c), 0.3)
    f = lagged(c, np.zeros((len(c), 0)), dt, tau, tau, f0)[0]
    state, fine = f[0], 20_000
    for i in range(1, len(c)):
        for u in (np.arange(fine) + 0.5) / fine:  # midpoint rule
            state += (c[i - 1] + u * (c[i] - c[i - 1]) - state) * -np.expm1(-0.3 / fine / tau)
        assert state == pytest.approx(f[i], rel=1e-6)
        if i == 3:
            break


def test_rise_and_fall_have_their_own_lag():
    step = np.array([0.0, 10.0, 10.0, 0.0, 0.0])
    dt = np.array([0.1, 1e-6, 1.0, 1e-6, 1.0])
    f, _, _, tau = lagged(step, np.zeros((5, 0)), dt, 0.5, 2.0, 0.0)
    assert f[2] == pytest.approx(10.0 * -np.expm1(-1.0 / 0.5), rel=1e-5)
    assert f[4] == pytest.approx(f[2] * np.exp(-1.0 / 2.0), rel=1e-5)
    np.testing.assert_array_equal(tau[[2, 4]], [0.5, 2.0])


@settings(deadline=None)
@given(signals)
def test_a_lagged_signal_stays_within_what_it_follows(c):
    f = lagged(c, np.zeros((len(c), 0)), np.full(len(c), 0.2), 0.5, 1.5, c[0])[0]
    assert np.all(f >= np.min(c) - 1e-9) and np.all(f <= np.max(c) + 1e-9)


def plainly(problem, theta):
    """Readings (m,), rows (m, P), and the field along the path."""
    sn, lay, law = problem.sniffs, problem.layout, problem.law
    t2, dt = 0.5 * sn.t_s**2, np.diff(sn.t_s, prepend=sn.t_s[0])
    p, jac = problem.arm.nose_jacobian(sn.q - theta[lay.offset] - t2[:, None] * theta[lay.drift])
    c, grad, r, rarity = concentration(p, theta[:LAW], law.r_ref_m, law.radius_m)
    by_q = np.einsum("ij,ijk->ik", grad[:, :3], jac)
    dc = c[:, None] * np.concatenate([grad, by_q, t2[:, None] * by_q], axis=1)
    gains, factor, e = np.exp(theta[lay.gain]), np.exp(theta[lay.tau]), sn.element[0]
    start = max((sn.ppm[0] - theta[lay.baseline][e]) / gains[e], 0.0)
    f, df, df_tau, tau = lagged(c, dc, dt, factor * problem.rise_s, factor * problem.fall_s, start)
    gain, each, rows = gains[sn.element], np.arange(len(sn.at)), np.zeros((len(sn.at), lay.size))
    rows[:, : LAW + 2 * lay.dof] = gain[:, None] * df[sn.at]
    rows[each, lay.gain.start + sn.element] = gain * f[sn.at]
    rows[:, lay.tau] = gain * df_tau[sn.at]
    rows[each, lay.baseline.start + sn.element] = 1.0
    if start > 0.0:
        left = gain * np.cumprod(np.exp(-dt / tau))[sn.at]
        rows[:, lay.baseline.start + e] -= left / gains[e]
        rows[:, lay.gain.start + e] -= left * start
    speed = np.linalg.norm(np.diff(p, axis=0, prepend=p[:1]), axis=1) / np.maximum(dt, 1e-9)
    return gain * f[sn.at], rows, np.array([c, rarity, r, speed, dt, tau])


@pytest.mark.parametrize(("dof", "elements", "poses"), [(1, 1, 6), (2, 2, 3), (3, 2, 8), (5, 1, 5), (5, 2, 8)])
def test_one_pass_says_what_the_plain_model_says(lab, dof, elements, poses):
    made = lab(dof, elements, seed=dof)
    theta = made.theta()
    problem = made.problem(theta, poses=poses)
    ppm, rows, along = plainly(problem, theta)
    made_, field = problem.predict(theta), problem.predict(theta).along.field
    compiled = np.array([field.mean_ppm, field.rarity, field.r_m, field.speed_m_s, made_.along.dt_s, made_.along.tau_s])
    np.testing.assert_allclose(made_.ppm, ppm, rtol=1e-9)
    np.testing.assert_allclose(compiled[[0, 1, 2, 4, 5]], along[[0, 1, 2, 4, 5]], rtol=1e-9)
    np.testing.assert_allclose(compiled[3], along[3], atol=1e-12)  # a nose that stands still: the difference of equal numbers
    scale = np.max(np.abs(rows), axis=0)
    np.testing.assert_allclose(made_.rows / scale, rows / scale, atol=1e-9)
    np.testing.assert_array_equal(problem.expect(theta), made_.ppm)  # with derivatives or without, to the bit


def test_ranked_together_or_expected_alone(lab):
    """Sums of squares of several places, as `expect` has them one by one."""
    made = lab(3, 2, seed=4)
    problem = search_problem(made.problem(made.theta()).sniffs, made.known)
    thetas = np.repeat(problem.mean[None, :], 5, axis=0)
    thetas[:, :4] = made.rng.uniform([0.2, -0.2, 0.1, 0.0], [0.4, 0.2, 0.3, 3.0], (5, 4))
    left, z = made.rng.uniform(0.0, 0.1, (2, len(problem.sniffs.at)))
    weight = made.rng.uniform(0.5, 2.0, len(left))
    costs, more = problem.grid_costs(thetas, left, z, weight)
    for theta, cost, ln in zip(thetas, costs, more, strict=True):
        h = problem.expect(theta) - left
        factor = max((weight @ (h * z)) / (weight @ (h * h)), 1e-6)
        assert (cost, ln) == (pytest.approx(weight @ (z - factor * h) ** 2, rel=1e-9), pytest.approx(np.log(factor), abs=1e-9))


def test_readings_off_the_path_are_refused(lab):
    made = lab(1, 1, seed=1)
    sn, law = made.problem(made.theta(), poses=3).sniffs, made.law
    path, scale = SensedPath(sn.t_s, sn.q, sn.at + len(sn.t_s), sn.element), LawScale(law.r_ref_m, law.radius_m)
    with pytest.raises(ValueError, match="on the path"):
        predict_readings(made.mean, path, 0.0, made.arm.adjoints[0], scale, Lag(0.4, 0.6), UNEXTENDED.knots, False)


kinds = st.lists(st.sampled_from([SLIDE, HINGE]), min_size=1, max_size=6)


@settings(deadline=None, max_examples=30)
@given(kinds, st.data(), st.integers(0, 2**32 - 1))
def test_links_are_the_poses(kinds, data, seed):
    """Any chain, any of its joints locked, joints of several turns."""
    rng, n = np.random.default_rng(seed), data.draw(st.integers(1, len(kinds)))
    poses, axes = np.tile(np.eye(4), (len(kinds), 1, 1)), rng.standard_normal((len(kinds), 3))
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    poses[:, :3, :3], poses[:, :3, 3] = np.linalg.qr(rng.standard_normal((len(kinds), 3, 3)))[0], rng.standard_normal((len(kinds), 3))
    chain = SerialChain(poses, axes, np.array(kinds), rng.standard_normal(len(kinds)), rng.standard_normal(3))
    q, gradient = rng.uniform(-20.0, 20.0, (BLOCK, n)), rng.standard_normal((3, BLOCK))
    p, jac = nose_and_jacobian(q, chain, True)
    links, joints, nose, by_q = adjoint_chain(chain, n), np.empty((n, ROWS, BLOCK)), np.empty((3, BLOCK)), np.empty((n, BLOCK))
    forward_positions(np.ascontiguousarray(q.T), links, joints, nose)
    np.testing.assert_allclose(nose.T, p, atol=1e-12)
    expected = np.einsum("ak,kaj->jk", gradient, jac)
    gradient_by_joints(gradient, links, joints, by_q)
    np.testing.assert_allclose(by_q, expected, atol=1e-11)


@given(st.floats(1e-4, 10.0), st.floats(0.01, 10.0))
def test_two_half_steps_of_the_lag_are_a_whole_one(dt, tau):
    """Of a signal that stays: only what is left of the past counts, and its weights sum to one."""
    whole, _, _ = lag_step(dt, tau)
    half, _, _ = lag_step(dt / 2, tau)
    assert half * half == pytest.approx(whole)
