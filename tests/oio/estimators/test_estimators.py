"""Every filter keeps its promises; ours agrees with filterpy's; and `check_estimator` catches a filter that cheats."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from oio.core.records import Belief, GasReading, JointState, nanoseconds
from oio.estimators.ekf import Ekf
from oio.estimators.filterpy_ekf import FilterpyEkf
from oio.inference.initial_belief import initial_belief
from oio.inference.map_fit import solve
from oio.testing import check_estimator

CHOICES = sorted(path.stem for path in (Path(__file__).resolve().parents[3] / "conf" / "ekf").glob("*.yaml"))


@pytest.fixture(scope="module")
def begun(lab):
    """A lab, a belief from a fit of half a trace, and the joints and readings of the rest.

    The filter has no state for gains and lag, so its model is given the true ones.
    """
    made = lab(3, 2, seed=21)
    theta, lay = made.theta(), made.layout
    factor = float(np.exp(theta[lay.tau]))
    gain = tuple(float(g) for g in np.exp(theta[lay.gain]))
    made.model = replace(made.model, gain=gain, rise_s=factor * made.model.rise_s, fall_s=factor * made.model.fall_s)
    problem = made.problem(theta, poses=10)
    half_s = problem.sniffs.t_s[-1] / 2
    fit = solve(replace(problem, sniffs=problem.sniffs.between(0.0, half_s)), theta, made.model.fluctuation)
    return made, theta, initial_belief(made.model, fit, nanoseconds(half_s), 5), rest(problem.sniffs, half_s)


def rest(sniffs, after_s):
    """(joints, reading or None) at every step of the path later than after_s."""
    readings = dict(zip(sniffs.at.tolist(), range(len(sniffs.at)), strict=True))
    out = []
    for i in np.flatnonzero(sniffs.t_s > after_s + 1e-6):
        t_ns, dq = nanoseconds(sniffs.t_s[i]), (sniffs.q[i] - sniffs.q[i - 1]) / (sniffs.t_s[i] - sniffs.t_s[i - 1])
        r = readings.get(int(i))
        reading = None if r is None else GasReading(t_ns, int(sniffs.element[r]), float(sniffs.ppm[r]), float(sniffs.sigma_ppm[r]))
        out.append((JointState(t_ns, sniffs.q[i], dq, np.zeros_like(dq)), reading))
    return out


def near(estimator, model, belief, joints):
    """A reading one standard deviation above what is expected at the time of the joints."""
    predicted = estimator.predict(model, belief, joints)
    blank = GasReading(joints.t_ns, 1, 0.0, 0.05)
    expected, row, r = model.measurement(predicted.mean, blank)
    return replace(blank, ppm=expected + float(np.sqrt(row @ predicted.cov @ row + r)))


@pytest.mark.parametrize("ekf", CHOICES)
def test_every_filter_keeps_its_promises(built, begun, ekf):
    made, _, belief, steps = begun
    estimator, joints = built("ekf", f"ekf={ekf}"), steps[0][0]
    check_estimator(estimator, made.model, belief, joints, near(estimator, made.model, belief, joints))


@pytest.mark.parametrize("ekf", CHOICES)
def test_a_reading_beyond_the_gate_is_not_used(built, begun, ekf):
    made, _, belief, _ = begun
    estimator, reading = built("ekf", f"ekf={ekf}"), GasReading(belief.t_ns, 0, 1e9, 0.05)
    after, innovation = estimator.update(made.model, belief, reading)
    assert innovation.gated and innovation.nis > 1e3
    np.testing.assert_array_equal(after.mean, belief.mean)
    np.testing.assert_array_equal(after.cov, belief.cov)


def test_ours_is_filterpys(begun):
    made, _, belief, steps = begun
    ours, theirs = Ekf(gate_nis=50.0), FilterpyEkf(gate_nis=50.0)
    mine = his = belief
    used = 0
    for joints, reading in steps:
        mine, his = ours.predict(made.model, mine, joints), theirs.predict(made.model, his, joints)
        if reading is not None:
            (mine, a), (his, b) = ours.update(made.model, mine, reading), theirs.update(made.model, his, reading)
            assert a.gated == b.gated and a.nis == pytest.approx(b.nis, rel=1e-7)
            used += not a.gated
    scale = np.sqrt(np.diag(mine.cov))
    np.testing.assert_allclose(mine.mean / scale, his.mean / scale, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(mine.cov / np.outer(scale, scale), his.cov / np.outer(scale, scale), atol=1e-9)
    assert used > 70


def test_the_filter_goes_on_where_the_fit_ended(begun):
    """On data of its own model: still consistent, and narrower than it began."""
    made, theta, belief, steps = begun
    estimator, at, nis = Ekf(gate_nis=50.0), made.model.at, []
    first = belief
    for joints, reading in steps:
        belief = estimator.predict(made.model, belief, joints)
        if reading is not None:
            belief, innovation = estimator.update(made.model, belief, reading)
            nis.append(innovation.nis)
    error = belief.mean[at["s"]] - theta[:3]
    assert error @ np.linalg.solve(belief.cov[at["s"], at["s"]], error) < 16.3  # chi-square 99.9 %, 3 degrees of freedom
    assert np.trace(belief.cov[at["s"], at["s"]]) < np.trace(first.cov[at["s"], at["s"]])
    assert np.mean(nis) == pytest.approx(1.0, abs=0.5)


@dataclass(frozen=True)
class Cheating:
    """A filter that breaks one promise."""

    how: str

    def predict(self, model, belief, joints):
        after = Ekf(gate_nis=50.0).predict(model, belief, joints)
        if self.how == "late":
            return replace(after, t_ns=belief.t_ns)
        if self.how == "lopsided":
            cov = np.array(after.cov)
            cov[0, 1] += 1.0
            return replace(after, cov=cov)
        return after

    def update(self, model, belief, reading):
        after, innovation = Ekf(gate_nis=50.0).update(model, belief, reading)
        if self.how == "wide":
            return Belief(after.t_ns, after.mean, 2.0 * belief.cov), innovation
        if self.how == "gate" and innovation.gated:
            return Belief(after.t_ns, after.mean + 1.0, after.cov), innovation
        return after, innovation


@pytest.mark.parametrize(
    ("how", "said"),
    [("late", "of the time of the joints"), ("lopsided", "symmetric"), ("wide", "never widens"), ("gate", "gated reading leaves")],
)
def test_a_cheat_is_found(begun, how, said):
    made, _, belief, steps = begun
    honest, joints = Cheating("honest"), steps[0][0]
    reading = near(honest, made.model, belief, joints)
    check_estimator(honest, made.model, belief, joints, reading)
    with pytest.raises(AssertionError, match=said):
        check_estimator(Cheating(how), made.model, belief, joints, reading)
