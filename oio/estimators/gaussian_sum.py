"""A bank of filters, one per hypothesis of the belief map, weighed by how well each foretells the readings (Alspach & Sorenson 1972)."""

from dataclasses import dataclass

import numpy as np

from oio.core.records import Array, Belief, GasReading, Innovation, JointState
from oio.core.settings import in_range, settings
from oio.estimators.base import Estimator
from oio.inference.map_fit import Fit
from oio.inference.state_space import StateSpace


@dataclass(frozen=True, slots=True, eq=False)
class GaussianMixture(Belief):
    """A sum of Gaussians; mean and cov are those of the sum."""

    members: tuple[Belief, ...]
    ln_weights: Array  # (k,), of weights that sum to one


@settings
class GaussianSum:
    """Every member is run by the filter `each`; an unlikely one is dropped."""

    each: Estimator
    gate_nis: float  # to a member, a larger NIS counts as this one: a reading that all but one refuse does not decide everything
    least_weight: float  # members below are dropped

    def check(self) -> None:
        """Refuse a gate that lets nothing pass, and a limit that drops everybody."""
        in_range(self, gate_nis=(1.0, 1e9), least_weight=(0.0, 0.5))

    def begin(self, model: StateSpace, fits: tuple[Fit, ...], t_ns: int, measurements: int) -> Belief:
        """One member per hypothesis; its weight is its evidence, exp(-chi^2 / 2) sqrt(det cov) (Laplace's approximation)."""
        members = tuple(model.begin(fit, t_ns, measurements) for fit in fits)
        evidence = [-0.5 * fit.chi2 + 0.5 * float(np.linalg.slogdet(fit.cov)[1]) for fit in fits]
        return self._summed(members, np.array(evidence))

    def predict(self, model: StateSpace, belief: Belief, joints: JointState) -> Belief:
        """Propagate every member."""
        bank = as_mixture(belief)
        return moment_matched(tuple(self.each.predict(model, member, joints) for member in bank.members), bank.ln_weights)

    def update(self, model: StateSpace, belief: Belief, reading: GasReading) -> tuple[Belief, Innovation]:
        """Condition every member on the reading, and the weights on how it was foretold; what all refuse leaves everything as it was."""
        bank = as_mixture(belief)
        both = [self.each.update(model, member, reading) for member in bank.members]
        surprises = [innovation for _, innovation in both]
        innovation = _mixture_innovation(np.exp(bank.ln_weights), surprises)
        if innovation.gated:
            return belief, innovation
        told = [-0.5 * (min(i.nis, self.gate_nis) + float(np.log(i.cov[0, 0]))) for i in surprises]
        return self._summed(tuple(member for member, _ in both), bank.ln_weights + told), innovation

    def _summed(self, members: tuple[Belief, ...], ln_weights: Array) -> GaussianMixture:
        """Members with normalised weights, without those below the least weight."""
        kept = np.flatnonzero(ln_weights - np.logaddexp.reduce(ln_weights) >= np.log(max(self.least_weight, 1e-300)))
        left = ln_weights[kept]
        return moment_matched(tuple(members[i] for i in kept), left - np.logaddexp.reduce(left))


def as_mixture(belief: Belief) -> GaussianMixture:
    """The belief as a sum; one Gaussian is a sum of one."""
    return belief if isinstance(belief, GaussianMixture) else GaussianMixture(belief.t_ns, belief.mean, belief.cov, (belief,), np.zeros(1))


def moment_matched(members: tuple[Belief, ...], ln_weights: Array) -> GaussianMixture:
    """The sum with its own mean, sum w x, and cov, sum w (P + (x - mean)(x - mean)')."""
    weights, means = np.exp(ln_weights), np.array([member.mean for member in members])
    mean = weights @ means
    cov = np.einsum("k,kij->ij", weights, [member.cov for member in members])
    away = means - mean
    cov = cov + np.einsum("k,ki,kj->ij", weights, away, away)
    return GaussianMixture(max(member.t_ns for member in members), mean, 0.5 * (cov + cov.T), members, ln_weights)


def _mixture_innovation(weights: Array, innovations: list[Innovation]) -> Innovation:
    """The reading less the sum's expectation, with the sum's variance; gated if all members gated it."""
    residuals = np.array([innovation.residual[0] for innovation in innovations])
    variances = np.array([innovation.cov[0, 0] for innovation in innovations])
    residual = float(weights @ residuals)
    variance = float(weights @ (variances + (residuals - residual) ** 2))
    gated = all(innovation.gated for innovation in innovations)
    return Innovation(innovations[0].t_ns, np.array([residual]), np.array([[variance]]), gated)
