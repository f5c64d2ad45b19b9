"""The compiled step is `Model.transition`, number for number; and its law does not hang on how often a filter is called."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oio.core.records import Belief, JointState, nanoseconds
from oio.estimators.gated_update import joseph
from oio.estimators.propagation import LinearizedStep, add_process_noise, predict, propagate_mean
from oio.gas.source_shape import CORNER, LINE, PARAMETERS, POINT, TWO, WALL, SourceShape
from oio.inference.uncertainty import Noise

LADDER = [(1, 1), (2, 2), (3, 1), (5, 2)]


def state(made, rng):
    """A plausible state (N,) of a lab."""
    at, n = made.model.at, made.arm.dof
    x = np.zeros(made.model.size)
    x[: 3 * n] = rng.standard_normal(3 * n) * np.repeat([1e-2, 1e-3, 1e-4], n)
    x[at["s"].start : at["b"].start] = made.theta()[:9]
    x[at["b"]], x[at["f"]], x[at["m"]] = 0.3, rng.uniform(0.0, 100.0), 0.1 * rng.standard_normal()
    return x


def joints(made, rng, t_s, moving=0.3):
    n = made.arm.dof
    return JointState(nanoseconds(t_s), made.arm.home + 0.1 * rng.standard_normal(n), moving * rng.standard_normal(n), np.zeros(n))


def covariance(size, rng):
    """Scales from 1e-18 to 1e4, as a belief's covariance has them."""
    root, sd = rng.standard_normal((size, size)), 10.0 ** rng.uniform(-9, 2, size)
    return np.outer(sd, sd) * (root @ root.T / size)


def drifting(model, drift=1e-3):
    return replace(model, process_noise=replace(model.process_noise, drift_deg_s2_sqrt_s=drift))


@pytest.mark.parametrize(("dof", "elements"), LADDER)
@given(
    seed=st.integers(0, 10**6), dt=st.floats(1e-3, 5.0), paper=st.booleans(), kind=st.sampled_from((POINT, TWO, LINE, WALL, CORNER)),
    sway=st.sampled_from((0.0, 0.15)),
)  # fmt: skip
def test_a_compiled_step_is_the_models(lab, dof, elements, seed, dt, paper, kind, sway):
    made, rng = lab(dof, elements, seed), np.random.default_rng(seed)
    noise = replace(Noise.nominal(), assembly="paper", source_q_m2=0.01) if paper else Noise.nominal()
    shape = SourceShape.of(kind, np.array([0.35, -0.1, 0.2, -0.3, 0.1, 0.2])[: PARAMETERS[kind]])
    air = replace(made.model.fluctuation, sway=sway)
    model = replace(drifting(made.model), noise=noise, shape=shape, fluctuation=air)
    x, sensed = state(made, rng), joints(made, rng, 7.0 + dt)
    cov, dt = covariance(model.size, rng), (nanoseconds(7.0 + dt) - nanoseconds(7.0)) / 1e9
    mean, f, q = model.transition(x, dt, sensed)
    after = predict(model, Belief(nanoseconds(7.0), x, cov), sensed)
    whole = f @ cov @ f.T + q
    scale = np.sqrt(np.diag(whole))
    np.testing.assert_allclose(after.mean, mean, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(after.cov / np.outer(scale, scale), whole / np.outer(scale, scale), atol=1e-12)
    np.testing.assert_array_equal(after.cov, after.cov.T)
    assert after.t_ns == sensed.t_ns


@pytest.mark.parametrize(("dof", "elements"), LADDER)
def test_a_linear_step_has_the_models_f_and_its_transpose(lab, dof, elements):
    made, rng = lab(dof, elements, 3), np.random.default_rng(3)
    model, x, sensed = drifting(made.model), state(made, rng), joints(made, rng, 0.1)
    (mean, f, q), away, cov = model.transition(x, 0.1, sensed), rng.standard_normal(model.size), covariance(model.size, rng)
    step = LinearizedStep.of(model, x, 0.1, sensed)
    after, spread = step.forward(x + away, cov)
    scale = np.sqrt(np.diag(f @ cov @ f.T + q))
    np.testing.assert_allclose(after, mean + f @ away, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(spread / np.outer(scale, scale), (f @ cov @ f.T + q) / np.outer(scale, scale), atol=1e-12)
    np.testing.assert_allclose(step.back(away), f.T @ away, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(add_process_noise(model, x, np.zeros_like(cov), 0.1, sensed), q, rtol=1e-12, atol=1e-30)


def test_many_states_move_as_each_does(lab):
    made, rng = lab(5, 2, 4), np.random.default_rng(4)
    x, sensed = np.array([state(made, rng) for _ in range(7)]), joints(made, rng, 0.1)
    each = [made.model.transition(row, 0.1, sensed)[0] for row in x]
    np.testing.assert_allclose(propagate_mean(made.model, x, 0.1, sensed), each, rtol=1e-12, atol=1e-15)


def test_joints_of_another_arm_are_refused(lab):
    made, rng = lab(3, 1, 5), np.random.default_rng(5)
    belief = Belief(0, state(made, rng), covariance(made.model.size, rng))
    with pytest.raises(ValueError, match="3 joint values"):
        predict(made.model, belief, joints(lab(5, 1), rng, 0.1))


@given(seed=st.integers(0, 10**6))
def test_an_update_is_josephs_and_never_widens(seed):
    """P = (I - K H) P (I - K H)' + K R K'."""
    rng = np.random.default_rng(seed)
    cov, row, r = covariance(9, rng), rng.standard_normal(9), 10.0 ** rng.uniform(-4, 4)
    mean, after = joseph(np.zeros(9), cov, row, 2.0, r)
    gain = cov @ row / (row @ cov @ row + r)
    left = np.eye(9) - np.outer(gain, row)
    scale = np.sqrt(np.diag(cov))
    np.testing.assert_allclose(mean / scale, 2.0 * gain / scale, atol=1e-12)
    expected = left @ cov @ left.T + r * np.outer(gain, gain)
    np.testing.assert_allclose(after / np.outer(scale, scale), expected / np.outer(scale, scale), atol=1e-10)
    assert np.all(np.diag(after) <= np.diag(cov) * (1 + 1e-9))


def halves(model, belief, sensed, parts):
    """The belief at the time of `sensed` in so many steps; the arm stands still."""
    for i in range(1, parts + 1):
        t_ns = belief.t_ns + (sensed.t_ns - belief.t_ns) // (parts - i + 1)
        belief = predict(model, belief, replace(sensed, t_ns=t_ns))
    return belief


@pytest.mark.parametrize(("wandering", "tolerance"), [(0.0, 1e-9), (1.0, 0.02)])
def test_twice_the_rate_is_the_same_law(lab, wandering, tolerance):
    """Q(2 dt) = F Q(dt) F' + Q(dt): exact, but for what drift and the source's own wandering do to the gas within a step."""
    made, rng = lab(5, 2, 6), np.random.default_rng(6)
    names = ("strength_sqrt_s", "exponent_sqrt_s", "wind_per_m_sqrt_s", "offset_deg_sqrt_s")
    process_noise = replace(made.process_noise, **{name: wandering * getattr(made.process_noise, name) for name in names})
    model = replace(made.model, process_noise=process_noise, noise=replace(Noise.nominal(), source_q_m2=1e-10 * wandering))
    x, sensed, arm = state(made, rng), joints(made, rng, 0.1, moving=0.0), slice(0, 3 * made.arm.dof)
    x[arm] = 0.0
    for variance in (0.0, 1e-6):
        spread = np.full(model.size, variance)
        spread[arm] *= wandering
        once, twice = (halves(model, Belief(0, x, np.diag(spread)), sensed, parts) for parts in (1, 2))
        scale = np.sqrt(np.maximum(np.diag(once.cov), 1e-30))
        np.testing.assert_allclose(twice.mean, once.mean, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(twice.cov / np.outer(scale, scale), once.cov / np.outer(scale, scale), atol=tolerance)
