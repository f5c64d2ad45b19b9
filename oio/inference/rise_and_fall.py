"""Lags of a sensor's rise and fall, fitted apart from the beacon's readings along the known path.

A step of gas would tell them from the readings alone (`oio.identification.step_response`), but before a beacon the gas at a moving nose
makes no steps: it changes with the range while the sensor still follows what was before. Hence the forward model of the beacon's fit,
with one parameter more, ln(lag of the fall over that of the rise), and next to no prior of both: what the data sheet says is left out, so
that the uncertainties are those of the readings.
"""

from dataclasses import dataclass, replace

import numpy as np

from oio.core.compiled import compiled
from oio.core.records import Array
from oio.gas.whitening import Whitening
from oio.inference.forward_kernel import lag_step
from oio.inference.forward_model import Prediction, Problem
from oio.inference.map_fit import Fit
from oio.inference.model_selection import hold_parameters, law_form

PRIOR_U = 1.5  # of ln(lag over that of the data sheet): a factor of 4.5
ITERATIONS, HALVINGS, DECREMENT = 12, 6, 1e-2  # the last in squared posterior standard deviations


@dataclass(frozen=True, slots=True)
class Lag:
    """Time constant [s], and the standard uncertainty of its logarithm."""

    tau_s: float
    u_ln: float


@dataclass(frozen=True, slots=True)
class RiseAndFall:
    """Lags of rise and fall by the readings alone; the ratio of fall to rise over that of the data sheet, and the standard uncertainty of
    its logarithm."""

    rise: Lag
    fall: Lag
    ratio: float
    ratio_u_ln: float


def rise_and_fall(problem: Problem, fit: Fit) -> RiseAndFall:
    """Return the lags in the problem that `fit` solves, by Gauss-Newton from there with the noise of the fit; as in `solve`, a step is
    judged with the whitening at its beginning."""
    apart = _Apart(problem, fit)
    x = apart.start
    for _ in range(ITERATIONS):
        whitening = apart.whitening(x)
        cost, hessian, gradient = apart.quadratic(x, whitening)
        step = np.linalg.solve(hessian, gradient)
        if step @ hessian @ step < DECREMENT:
            break
        shortened = (step * 0.5**halvings for halvings in range(HALVINGS))
        taken = next((part for part in shortened if apart.quadratic(x + part, whitening)[0] < cost), None)
        if taken is None:
            break
        x = x + taken
    _, hessian, _ = apart.quadratic(x, apart.whitening(x))
    return apart.result(x, np.asarray(np.linalg.inv(hessian), dtype=np.float64))


def by_ln_fall(problem: Problem, theta: Array, expected: Prediction) -> Array:
    """Derivative (m,) [ppm] of the readings expected at theta by ln(lag of the fall).

    Where the gas passes the sensor's own state, a step of the path changes from fall to rise, and readings leap a little: differences of
    two predictions would take such a leap for a derivative.
    """
    lay, sniffs, along = problem.layout, problem.sniffs, expected.along
    every = np.ones(len(along.at), dtype=np.bool_)
    if along.second is None:
        fields = [(along.field.mean_ppm, along.tau_s, every)]
    else:
        there = along.second.is_second
        fields = [(along.field.mean_ppm, along.tau_s, ~there), (along.second.field.mean_ppm, along.second.tau_s, there)]
    out = np.empty(len(along.at))
    for mean_ppm, tau_s, here in fields:
        first = int(np.argmax(here))
        e, begin = sniffs.element[first], along.at[first]
        initial = max(float((sniffs.ppm[first] - theta[lay.baseline][e]) / np.exp(theta[lay.gain][e])), 0.0)
        dt_s = along.dt_s[begin:].copy()
        dt_s[0] = 0.0
        out[here] = _lagged_by_ln_fall(mean_ppm[begin:], dt_s, tau_s[begin:], initial)[along.at[here] - begin]
    return np.asarray(along.gain * out)


@compiled
def _lagged_by_ln_fall(c: Array, dt: Array, tau: Array, initial: float) -> Array:
    """Derivative (k,) [ppm] of the lagged concentration f by ln(tau) of the steps on which it falls; see `oio.inference.forward_kernel`."""
    out, f, df = np.empty(len(c)), initial, 0.0
    for i in range(len(c)):
        c0 = c[max(i - 1, 0)]
        phi, share, to_phi = lag_step(dt[i], tau[i])
        w0, w1 = share - phi, 1.0 - share
        df = phi * df + (0.0 if c[i] > f else f * to_phi - c[i] * w0 + c0 * (w0 - to_phi))
        f = phi * f + w0 * c0 + w1 * c[i]
        out[i] = df
    return out


class _Apart:
    """The problem of a fit with one parameter more: x = (theta, ln(fall over rise)), (P + 1,)."""

    def __init__(self, problem: Problem, fit: Fit) -> None:
        self._problem, self._noise = hold_parameters(replace(problem, law=fit.law), law_form(fit)), fit.fluctuation
        self._mean, cov = self._open_prior()
        self._precision = np.linalg.inv(cov)
        self.start = np.append(fit.mean, 0.0)

    def _open_prior(self) -> tuple[Array, Array]:
        """Rise and fall are open, and independent of each other."""
        size, tau = self._problem.layout.size, self._problem.layout.tau
        cov = np.zeros((size + 1, size + 1))
        cov[:size, :size] = self._problem.cov
        cov[tau, :] = cov[:, tau] = 0.0
        cov[tau, tau], cov[size, size] = PRIOR_U**2, 2.0 * PRIOR_U**2
        cov[tau, size] = cov[size, tau] = -(PRIOR_U**2)
        return np.append(self._problem.mean, 0.0), cov

    def whitening(self, x: Array) -> Whitening:
        """The whitening of the residuals at x."""
        return Whitening(self._with_fall(float(x[-1])).predict(x[:-1], False).along, self._noise)

    def quadratic(self, x: Array, whitening: Whitening) -> tuple[float, Array, Array]:
        """Weighted sum of squares at x, its Gauss-Newton Hessian, and minus half its gradient."""
        theta, there = x[:-1], self._with_fall(float(x[-1]))
        expected = there.predict(theta)
        by_ratio = by_ln_fall(there, theta, expected)
        stacked = np.column_stack([there.residual(theta, expected.ppm), expected.rows, by_ratio])
        white = whitening.of(stacked, expected.along.variance_ppm2).rows
        residual, rows, off = white[:, 0], white[:, 1:], x - self._mean
        cost = float(residual @ residual + off @ self._precision @ off)
        return cost, rows.T @ rows + self._precision, rows.T @ residual - self._precision @ off

    def _with_fall(self, ln_ratio: float) -> Problem:
        return replace(self._problem, fall_s=self._problem.fall_s * float(np.exp(ln_ratio)))

    def result(self, x: Array, cov: Array) -> RiseAndFall:
        """Return the lags at x with their uncertainties by its covariance (P + 1, P + 1)."""
        tau, to_fall = self._problem.layout.tau, np.zeros(len(x))
        to_fall[[tau, -1]] = 1.0
        rise, ratio = float(np.exp(x[tau])), float(np.exp(x[-1]))
        return RiseAndFall(
            Lag(self._problem.rise_s * rise, float(np.sqrt(cov[tau, tau]))),
            Lag(self._problem.fall_s * rise * ratio, float(np.sqrt(to_fall @ cov @ to_fall))),
            ratio, float(np.sqrt(cov[-1, -1])),
        )  # fmt: skip
