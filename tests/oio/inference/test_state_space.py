"""The state's transition and measurement with their Jacobians, process noise as a density, and the belief of a fit carried in time."""

from dataclasses import replace

import numpy as np
import pytest

from oio.core.records import GasReading, JointState, nanoseconds
from oio.gas.source_shape import POINT_SOURCE, TWO, SourceShape
from oio.inference.initial_belief import initial_belief
from oio.inference.law_extension import Densities, LawExtension
from oio.inference.map_fit import Fit
from oio.inference.uncertainty import Noise

PAPER = replace(Noise.nominal(), assembly="paper", source_q_m2=0.01, r_ppm2=0.7)
EXACT = ("o", "v", "a", "s", "l", "n", "k", "u", "b")  # blocks whose process noise does not hang on where the nose is


def state(made, seed=0, fluctuation=0.0, lagged_ppm=2.0):
    """A plausible state; its lagged concentration is far below what the nose feels, so that the lag rises."""
    rng, at = np.random.default_rng(seed), made.model.at
    x, theta = np.zeros(made.model.size), made.theta()
    x[at["o"]], x[at["v"]], x[at["a"]] = (scale * rng.standard_normal(made.arm.dof) for scale in (1e-2, 1e-3, 1e-4))
    x[at["s"].start : at["b"].start] = theta[:9]
    x[at["b"]], x[at["f"]], x[at["m"]] = 0.3, lagged_ppm, fluctuation
    return x


def joints(made, t_s=0.0, moving=0.3):
    n = made.arm.dof
    return JointState(nanoseconds(t_s), made.arm.home + 0.1, np.full(n, moving), np.zeros(n))


def difference(f, x, size, h):
    return np.column_stack([(f(x + h * np.eye(size)[j]) - f(x - h * np.eye(size)[j])) / (2 * h) for j in range(size)])


@pytest.mark.parametrize(("dof", "elements"), [(1, 1), (3, 2), (5, 2)])
@pytest.mark.parametrize("lagged_ppm", [0.5, 400.0])
@pytest.mark.parametrize("shape", [POINT_SOURCE, SourceShape.of(TWO, np.array([0.35, -0.1, 0.2, -0.3]))])
def test_f_is_the_central_difference(lab, dof, elements, lagged_ppm, shape):
    made = lab(dof, elements, seed=dof)
    model, x, sensed = replace(made.model, shape=shape), state(made, lagged_ppm=lagged_ppm), joints(made)
    numeric = difference(lambda y: model.transition(y, 0.3, sensed)[0], x, model.size, 1e-6)
    np.testing.assert_allclose(model.transition(x, 0.3, sensed)[1], numeric, rtol=1e-5, atol=1e-6)


def swept(made, x, dt_s, for_s=0.4):
    """The lagged concentration after a sweep at constant speed in steps of dt_s, in air that does not fluctuate."""
    n, home, at = made.arm.dof, made.arm.home, made.model.at
    speed = np.full(n, 0.3)
    x = np.array(x)
    x[at["v"]] = x[at["a"]] = x[at["m"]] = 0.0
    for i in range(1, round(for_s / dt_s) + 1):
        sensed = JointState(nanoseconds(i * dt_s), home + i * dt_s * speed, speed, np.zeros(n))
        x = made.model.transition(x, dt_s, sensed)[0]
    return float(x[at["f"].start])


@pytest.mark.parametrize("seed", range(4))
def test_the_gas_of_a_step_is_not_ahead_of_the_nose(lab, seed):
    """It is that midway: the error of a sweep goes with the square of the step. The gas of a step's end would err by half a step."""
    made = lab(3, 1, seed=seed)
    x = state(made, seed)
    exact = swept(made, x, 1e-3)
    errors = np.array([swept(made, x, dt_s) - exact for dt_s in (0.1, 0.05)])
    assert abs(errors[1]) < 0.3 * abs(errors[0]) + 1e-6
    assert abs(errors[1]) < 2e-3 * exact


def test_h_is_the_central_difference(lab):
    made = lab(3, 2, seed=1)
    model, x = replace(made.model, gain=(1.0, 1.7)), state(made)
    for element in (0, 1):
        reading = GasReading(0, element, 5.0, 0.1)
        numeric = difference(lambda y, r=reading: np.array([model.measurement(y, r)[0]]), x, model.size, 1e-4)[0]
        np.testing.assert_allclose(model.measurement(x, reading)[1], numeric, atol=1e-8)
    assert model.measurement(x, GasReading(0, 1, 5.0, 0.1))[0] == pytest.approx(1.7 * 2.0 + 0.3)


def test_r_is_that_of_a_fresh_reading_or_the_assemblys(lab):
    made, reading = lab(3, 1), GasReading(0, 0, 5.0, 0.1)
    scaled = replace(made.model, fluctuation=replace(made.model.fluctuation, scale=4.0))
    assert scaled.measurement(state(made), reading)[2] == pytest.approx(4.0 * 0.1**2)
    paper = replace(made.model, noise=PAPER)
    assert paper.measurement(state(made), reading)[2] == 0.7


def blocks(model, names):
    return np.concatenate([np.arange(model.size)[model.at[name]] for name in names])


def test_process_noise_is_a_density(lab):
    """Q(2 dt) = F Q(dt) F' + Q(dt) in the blocks that drift, and in the fluctuation while the nose stands."""
    made = lab(3, 2)
    x, still = state(made), joints(made, moving=0.0)
    x[made.model.at["v"]] = x[made.model.at["a"]] = 0.0
    _, f, q = made.model.transition(x, 0.2, still)
    _, _, twice = made.model.transition(x, 0.4, still)
    both = f @ q @ f.T + q
    for names in (EXACT, ("m",)):
        at = np.ix_(blocks(made.model, names), blocks(made.model, names))
        np.testing.assert_allclose(both[at], twice[at], rtol=1e-9, atol=1e-18)
    assert np.all(np.diag(q)[blocks(made.model, ("o", "s", "n", "k", "b", "m"))] > 0)


def test_drifting_acceleration_is_a_density_too(lab):
    made = lab(3, 1)
    model = replace(made.model, process_noise=replace(made.process_noise, drift_deg_s2_sqrt_s=1e-3))
    x, still = state(made), joints(made, moving=0.0)
    _, f, q = model.transition(x, 0.2, still)
    at = np.ix_(blocks(model, ("o", "v", "a")), blocks(model, ("o", "v", "a")))
    np.testing.assert_allclose((f @ q @ f.T + q)[at], model.transition(x, 0.4, still)[2][at], rtol=1e-6)


def test_the_papers_process_noise_is_per_step_and_a_density_is_per_second(lab):
    made = lab(3, 1)
    paper = replace(made.model, noise=PAPER)
    for dt_s in (0.1, 1.0):
        assert np.diag(paper.transition(state(made), dt_s, joints(made))[2])[paper.at["s"]] == pytest.approx(0.01)
    gum = [np.diag(made.model.transition(state(made), dt_s, joints(made))[2])[made.model.at["s"]][0] for dt_s in (0.1, 1.0)]
    assert gum[1] == pytest.approx(10 * gum[0]) and gum[1] < 1e-9


def test_drift_is_quadratic_and_two_half_steps_are_one(lab):
    made = lab(3, 1)
    x, at, still = state(made), made.model.at, joints(made, moving=0.0)
    whole = made.model.transition(x, 1.0, still)[0]
    half = made.model.transition(made.model.transition(x, 0.5, still)[0], 0.5, still)[0]
    np.testing.assert_allclose(whole[at["o"]], x[at["o"]] + x[at["v"]] + 0.5 * x[at["a"]])
    for name in ("o", "v", "a", "s", "l", "b"):
        np.testing.assert_allclose(half[at[name]], whole[at[name]])


def test_q_is_positive(lab):
    made = lab(5, 2)
    for seed in range(10):
        q = made.model.transition(state(made, seed), 0.02, joints(made, moving=0.5))[2]
        np.testing.assert_array_equal(q, q.T)
        f, m = made.model.at["f"].start, made.model.at["m"].start
        assert q[f, f] * q[m, m] >= q[f, m] ** 2 * (1 - 1e-6) and np.all(np.diag(q) >= 0)


@pytest.mark.parametrize(("dof", "elements"), [(1, 1), (2, 2), (5, 2)])
def test_every_state_has_a_place_a_name_and_a_unit(lab, dof, elements):
    model = lab(dof, elements).model
    assert len(model.names) == len(set(model.names)) == len(model.units) == model.size
    covered = np.concatenate([np.arange(model.size)[where] for where in model.at.values()])
    np.testing.assert_array_equal(covered, np.arange(model.size))
    assert model.names[model.at["s"].start] == "source_x" and model.units[model.at["s"].start] == "m"
    assert model.names[model.at["b"].start] == "baseline_0" and model.units[model.at["f"].start] == "ppm"


def fit_of(made, theta):
    root = np.random.default_rng(0).standard_normal((len(theta), len(theta)))
    spread = np.sqrt(np.diag(made.cov))
    cov = np.outer(spread, spread) * (root @ root.T / len(theta))
    return Fit(made.layout, theta, cov, 0.0, 7.0, made.model.fluctuation, 100, made.law)


def test_a_belief_begins_with_the_drift_of_its_time(lab):
    made = lab(3, 2, seed=1)
    fit, t = fit_of(made, made.theta()), 40.0
    belief, at, lay = initial_belief(made.model, fit, nanoseconds(t), 6), made.model.at, made.layout
    o, a = fit.mean[lay.offset], fit.mean[lay.drift]
    np.testing.assert_allclose(belief.mean[at["o"]], o + 0.5 * a * t**2)
    np.testing.assert_allclose(belief.mean[at["v"]], a * t)
    np.testing.assert_allclose(belief.mean[at["a"]], a)
    np.testing.assert_array_equal(belief.mean[at["s"]], fit.mean[:3])
    np.testing.assert_array_equal(belief.mean[at["b"]], fit.mean[lay.baseline])
    assert belief.mean[at["f"]] == [7.0] and belief.t_ns == nanoseconds(t)
    np.testing.assert_allclose(belief.cov[at["v"], at["a"]], t * fit.cov[lay.drift, lay.drift], rtol=1e-6, atol=1e-17)
    both = fit.cov[lay.offset, lay.offset] + 0.25 * t**4 * fit.cov[lay.drift, lay.drift]
    cross = 0.5 * t**2 * (fit.cov[lay.offset, lay.drift] + fit.cov[lay.drift, lay.offset])
    np.testing.assert_allclose(belief.cov[at["o"], at["o"]], both + cross, rtol=1e-6, atol=1e-17)
    assert np.linalg.eigvalsh(belief.cov).min() > -1e-12


def test_type_b_widens_the_beginning_of_the_source_alone(lab):
    made = lab(3, 1, seed=1)
    fit, wide = fit_of(made, made.theta()), replace(made.model, noise=replace(Noise.nominal(), source_p0_m2=0.01**2, measurements=5))
    for measurements, share in ((1, 1.0), (5, 1.0), (10, 0.5)):  # of more measurements than a repeat had, less in proportion
        added = initial_belief(wide, fit, 0, measurements).cov - initial_belief(made.model, fit, 0, measurements).cov
        expected = np.zeros(made.model.size)
        expected[made.model.at["s"]] = share * 0.01**2
        np.testing.assert_allclose(added, np.diag(expected), atol=1e-15)


def test_the_nose_is_at_the_joints_less_their_offset(lab):
    made = lab(3, 1, seed=1)
    belief, sensed = initial_belief(made.model, fit_of(made, made.theta()), 0, 6), joints(made)
    p, cov = made.model.nose(belief, sensed)
    np.testing.assert_allclose(p, made.arm.nose(sensed.q - belief.mean[made.model.at["o"]]))
    assert cov.shape == (3, 3) and np.linalg.eigvalsh(cov).min() > -1e-15


def extended_fit(made, extension, values):
    fit = fit_of(made, made.theta())
    n = made.layout.size
    cov = 1e-4 * np.eye(n + extension.size)
    cov[:n, :n] = fit.cov
    layout = replace(made.layout, extra=extension.size)
    return replace(fit, layout=layout, mean=np.concatenate([fit.mean, values]), cov=cov, extension=extension), fit


def test_what_changed_begins_as_it_is_at_the_end(lab):
    """Of a random walk the last knot counts: strength, wind, and background by the gain of each element."""
    made = lab(3, 2, seed=1)
    knots = (0.0, 10.0, 20.0)
    extension = LawExtension(strength_s=knots, wind_s=knots, background_s=knots)
    values = np.array([-0.1, -0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 9.0])
    fit, plain = extended_fit(made, extension, values)
    model, at = replace(made.model, gain=(1.0, 0.5)), made.model.at
    more = initial_belief(model, fit, 0, 6).mean - initial_belief(model, plain, 0, 6).mean
    expected = np.zeros(model.size)
    expected[at["l"]], expected[at["k"]], expected[at["b"]] = -0.5, [4.0, 5.0, 6.0], [9.0, 4.5]
    np.testing.assert_allclose(more, expected, atol=1e-12)


def test_the_model_after_a_map_is_that_of_its_world(lab):
    made = lab(3, 1, seed=1)
    plain = made.model.after(fit_of(made, made.theta()))
    assert plain.shape == POINT_SOURCE and plain.process_noise == made.model.process_noise
    fit, _ = extended_fit(made, LawExtension(TWO), np.array([0.3, 0.1, 0.2, -0.4]))
    assert made.model.after(fit).shape == SourceShape.of(TWO, np.array([0.3, 0.1, 0.2, -0.4]))
    walking, _ = extended_fit(made, LawExtension(strength_s=(0.0, 9.0), densities=Densities(0.1, 3.0, 0.2)), np.array([-0.2]))
    noise = made.model.after(walking).process_noise
    assert noise.strength_sqrt_s == 0.1 and noise.wind_per_m_sqrt_s == made.model.process_noise.wind_per_m_sqrt_s
    raised = replace(fit_of(made, made.theta()), fluctuation=replace(made.model.fluctuation, gamma=1.0))
    assert made.model.after(raised).fluctuation.gamma == 1.0
