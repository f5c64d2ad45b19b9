"""Readings that are stamped late: the path is shifted, the joints are held back, and the beacon tells by how much."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oio.core.records import GasReading, JointState, nanoseconds
from oio.estimators.odometry import Odometry
from oio.gas.fluctuation import Fluctuation
from oio.gas.timing import Delay, JointDelayLine, shift_path
from oio.inference.delay_fit import fit_delay
from oio.inference.map_fit import solve

CALM = Fluctuation(1.0, 0.05, 0.3)


def late(sniffs, delay_s):
    """What a bench makes of them that stamps every reading `delay_s` late."""
    times = sniffs.reading_t_s + delay_s
    kept = times <= sniffs.t_s[-1]
    return replace(
        sniffs, at=np.searchsorted(sniffs.t_s, times[kept] + 1e-9) - 1, reading_t_s=times[kept], element=sniffs.element[kept],
        ppm=sniffs.ppm[kept], sigma_ppm=sniffs.sigma_ppm[kept], censored=sniffs.censored[kept],
    )  # fmt: skip


def beacon(lab, delay_s, seed, tau_u=0.05):
    """A lab, its truth, and late readings about a source whose place is known."""
    made = lab(3, 1, seed=seed)
    theta = made.theta()
    problem = made.problem(theta, poses=16, noise=CALM)
    mean, cov = np.array(problem.mean), np.array(problem.cov)
    mean[:4], cov[:3, :], cov[:, :3] = theta[:4], 0.0, 0.0
    cov[range(3), range(3)] = 1e-6
    cov[made.layout.tau, made.layout.tau] = tau_u**2
    return made, theta, replace(problem, mean=mean, cov=cov, sniffs=late(problem.sniffs, delay_s))


@pytest.mark.parametrize("delay_s", [0.0, 0.05, 0.15, 0.3])
def test_no_delay_shifts_nothing_and_a_delay_takes_a_reading_to_where_it_was_taken(lab, delay_s):
    made = lab(3, 1, seed=1)
    sniffs = made.problem(made.theta()).sniffs
    back = shift_path(late(sniffs, delay_s), delay_s)
    if delay_s == 0.0:
        assert shift_path(sniffs, 0.0) is sniffs
    kept = sniffs.q[sniffs.at][: len(back.at)]
    np.testing.assert_allclose(back.q[back.at], kept, atol=1e-9)
    np.testing.assert_allclose(back.t_s[back.at], back.reading_t_s)
    assert np.all(np.diff(back.t_s) > 0) and back.at[0] == 0


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("delay_s", [0.0, 0.15])
def test_the_beacon_tells_the_delay(lab, seed, delay_s):
    _, theta, problem = beacon(lab, delay_s, 700 + seed)
    found = fit_delay(problem, Delay(0.1, 0.1), lambda p: solve(p, theta, CALM))
    assert abs(found.s - delay_s) < 2.5 * found.u_s + 0.005 and found.u_s < 0.05


def test_what_knows_the_lag_less_knows_the_delay_less(lab):
    """Both shift a slow signal: the sum is told, the parts as well as the lag is known."""
    sure, vague = (
        fit_delay(problem, Delay(0.1, 0.1), lambda p, theta=theta: solve(p, theta, CALM))
        for _, theta, problem in (beacon(lab, 0.15, 710, tau_u) for tau_u in (0.01, 0.5))
    )
    assert sure.u_s < vague.u_s


def joints(t_s, q):
    return JointState(nanoseconds(t_s), np.array([q]), np.array([1.0]), np.array([0.0]))


def test_joints_that_are_not_late_pass_as_they_are():
    held, state = JointDelayLine(0.0), joints(1.0, 0.5)
    assert held.joints(state) == [state]
    assert held.reading(GasReading(nanoseconds(1.0), 0, 1.0, 0.1)) == []


@given(st.floats(0.01, 0.5), st.lists(st.booleans(), min_size=5, max_size=60))
def test_a_reading_meets_the_joints_of_its_own_time(delay_s, order):
    """A nose that moves at 1 rad/s: at the stamp t the joints that come out read t - d."""
    held, t_s, out = JointDelayLine(delay_s), 0.0, []
    for is_reading in order:
        t_s += 0.02
        due = held.joints(joints(t_s, t_s))
        if is_reading:
            due += held.reading(GasReading(nanoseconds(t_s), 0, 1.0, 0.1))
        out += due
        for state in due:
            assert state.q[0] == pytest.approx(state.t_ns / 1e9 - delay_s, abs=1e-6)
        if is_reading and t_s > delay_s + 0.05:
            assert out[-1].t_ns == nanoseconds(t_s)
    times = [state.t_ns for state in out]
    assert times == sorted(set(times))


def test_an_odometry_that_knows_the_delay_has_the_trace_of_a_prompt_bench(lab, built):
    made = lab(3, 1, seed=3)
    sniffs = made.problem(made.theta(), poses=6).sniffs
    prompt, same = (Odometry(built("ekf"), replace(made.known, delay_s=d), built("belief_map")) for d in (0.0, 0.1))
    due = dict(zip(sniffs.at.tolist(), range(len(sniffs.at)), strict=True))
    for i, (t_s, q) in enumerate(zip(sniffs.t_s, sniffs.q, strict=True)):
        for odometry, r in ((prompt, due.get(i)), (same, due.get(i - 2))):  # two steps of the path later
            odometry.joints(JointState(nanoseconds(t_s), q, 0 * q, 0 * q))
            if r is not None:
                odometry.reading(GasReading(nanoseconds(t_s), 0, float(sniffs.ppm[r]), float(sniffs.sigma_ppm[r])))
    a, b = prompt.trace.as_arrays(), same.trace.as_arrays()
    n = len(b.at)
    assert len(a.at) - n <= 1
    np.testing.assert_array_equal(a.ppm[:n], b.ppm)
    np.testing.assert_allclose(a.q[a.at][:n], b.q[b.at], atol=1e-9)
    np.testing.assert_allclose(a.reading_t_s[:n] + 0.1, b.reading_t_s, atol=1e-6)
