"""Smoothing a window: against a dense Gaussian of all its states, at its fixed point, and what a window keeps and lets go."""

import numpy as np
import pytest

from oio.core.records import GasReading, seconds
from oio.estimators.propagation import LinearizedStep, predict
from oio.estimators.smoothing_window import Window, WindowedBelief, as_windowed, backward_pass, forward_pass

WINDOW = Window(readings=4, steps=1000, iterations=30, convergence_sigmas=1e-6)


def sensed_of(steps):
    return tuple(s for joints, reading in steps for s in ((joints,) if reading is None else (joints, reading)))


def linearised(model, belief, since):
    """The extended filter's own states (k, N) before each step."""
    path, belief = [], belief
    for sensed in since:
        if not isinstance(sensed, GasReading):
            path.append(belief.mean)
            belief = predict(model, belief, sensed)
    return np.array(path)


def dense(model, anchor, since, path):
    """Mean and cov of all states (k + 1, N) of the linearised window given its readings, by one big Gaussian."""
    size, means, covs, t_ns, readings = model.size, [anchor.mean], [[anchor.cov]], anchor.t_ns, []
    for sensed in since:
        if isinstance(sensed, GasReading):
            readings.append((len(means) - 1, sensed))
            continue
        at = path[len(means) - 1]
        mean, f, q = model.transition(at, seconds(sensed.t_ns - t_ns), sensed)
        for row in covs:
            row.append(row[-1] @ f.T)  # covariance with the new state
        covs.append([f @ covs[-1][-2] @ f.T + q])
        means.append(mean + f @ (means[-1] - at))
        t_ns = sensed.t_ns
    k = len(means)
    cov = np.zeros((k * size, k * size))
    for i in range(k):
        for j in range(i, k):
            cov[i * size : (i + 1) * size, j * size : (j + 1) * size] = covs[i][j - i]
            cov[j * size : (j + 1) * size, i * size : (i + 1) * size] = covs[i][j - i].T
    x, h, z, r = np.concatenate(means), np.zeros((len(readings), k * size)), np.zeros(len(readings)), np.zeros(len(readings))
    for m, (i, reading) in enumerate(readings):
        _, h[m, i * size : (i + 1) * size], r[m] = model.measurement(means[i], reading)
        z[m] = reading.ppm
    gain = np.linalg.solve(h @ cov @ h.T + np.diag(r), h @ cov).T
    return (x + gain @ (z - h @ x)).reshape(k, size), cov - gain @ h @ cov


def test_a_pass_is_the_big_gaussian(search):
    model, _, belief, steps = search(3, 2, seed=1)
    since = sensed_of(steps[:8])
    path = linearised(model, belief, since)
    passed, (mean, cov) = forward_pass(model, belief, since, path), dense(model, belief, since, path)
    last, scale = passed.beliefs[-1], np.sqrt(np.diag(belief.cov))
    sd = np.sqrt(np.diag(last.cov))
    np.testing.assert_allclose((last.mean - mean[-1]) / sd, 0.0, atol=1e-5)
    np.testing.assert_allclose(last.cov / np.outer(sd, sd), cov[-model.size :, -model.size :] / np.outer(sd, sd), atol=1e-5)
    np.testing.assert_allclose((backward_pass(passed, path) - mean[:-1]) / scale, 0.0, atol=1e-5)


def test_it_ends_where_it_is_linearised_about_its_own_answer(search):
    """Gauss-Newton has settled: once more through the window changes nothing."""
    model, _, belief, steps = search(3, 2, seed=2)
    since = sensed_of(steps[:6])
    window = Window(readings=1000, steps=1000, iterations=30, convergence_sigmas=1e-6)
    for sensed in since:
        belief = window.update(model, belief, sensed, 25.0)[0] if isinstance(sensed, GasReading) else window.predict(model, belief, sensed)
    assert isinstance(belief, WindowedBelief) and belief.since == since
    again = forward_pass(model, belief.anchor, since, belief.path)
    assert again.moved(backward_pass(again, belief.path) - belief.path) < 1e-5
    plain = forward_pass(model, belief.anchor, since, linearised(model, belief.anchor, since)).beliefs[-1]
    assert plain.mean != pytest.approx(belief.mean, rel=1e-6)


def test_no_pass_goes_farther_than_the_one_before(search):
    """However far off the reading is: the answer stays finite, and is that of the extended filter if iterating does not help."""
    model, _, belief, steps = search(3, 2, seed=3)
    joints, _ = steps[0]
    predicted_ = WINDOW.predict(model, belief, joints)
    for ppm in (-1e3, 0.0, 1e3):
        after, innovation = WINDOW.update(model, predicted_, GasReading(joints.t_ns, 0, ppm, 0.05), 1e9)
        assert not innovation.gated and np.all(np.isfinite(after.mean)) and np.all(np.diag(after.cov) > 0)


def test_a_window_keeps_so_many_readings_and_so_many_steps(search):
    model, _, belief, steps = search(3, 2, seed=4)
    for joints, reading in steps[:40]:
        belief = WINDOW.predict(model, belief, joints)
        if reading is not None:
            belief, _ = WINDOW.update(model, belief, reading, 1e9)
        readings = sum(isinstance(sensed, GasReading) for sensed in belief.since)
        assert readings <= 3 and len(belief.path) == len(belief.since) - readings
        assert not belief.path.flags.writeable
    assert readings == 3 and belief.anchor.t_ns == belief.since[0].t_ns - 50_000_000
    short = Window(readings=4, steps=5, iterations=2, convergence_sigmas=0.01)
    for joints, _ in steps[40:]:
        belief = short.predict(model, belief, joints)
        assert len(belief.path) <= 30 and type(belief.anchor) is not WindowedBelief
    assert len(belief.path) <= 5


def test_the_prediction_is_the_extended_filters(search):
    model, _, belief, steps = search(3, 2, seed=5)
    after, plain = WINDOW.predict(model, belief, steps[0][0]), predict(model, belief, steps[0][0])
    assert after.mean.tobytes() == plain.mean.tobytes() and after.cov.tobytes() == plain.cov.tobytes()
    assert as_windowed(after) is after and LinearizedStep.of(model, belief.mean, 0.05, steps[0][0]).mean == pytest.approx(plain.mean)
