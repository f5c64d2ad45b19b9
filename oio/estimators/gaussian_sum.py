"""Gaussian sum filter: a bank of filters, one per hypothesis of the belief map, weighted by likelihood (Alspach & Sorenson 1972)."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from oio.core.records import Array, Belief, GasReading, Innovation, JointState
from oio.core.settings import Within, settings
from oio.estimators.base import Estimator
from oio.inference.initial_belief import initial_belief
from oio.inference.map_fit import Fit
from oio.inference.state_space import StateSpace


@dataclass(frozen=True, slots=True, eq=False)
class GaussianMixture(Belief):
    """Gaussian mixture; `mean` and `cov` are those of the whole mixture."""

    members: tuple[Belief, ...]  # the k components
    ln_weights: Array  # (k,), logarithms of weights that sum to one


@settings
class GaussianSum:
    """Gaussian sum filter: every mixture component is run by the filter `component_filter`; components of low weight are pruned."""

    component_filter: Estimator
    # gate_nis: upper limit of a component's NIS in its likelihood: a reading that all but one gate does not decide alone
    gate_nis: Annotated[float, Within(1, 1e9)]
    min_weight: Annotated[float, Within(0, 0.5)]  # components of a smaller weight are pruned

    def begin(self, model: StateSpace, fits: tuple[Fit, ...], t_ns: int, measurements: int) -> Belief:
        """Return one component per hypothesis; its weight is its evidence, exp(-chi^2 / 2) sqrt(det cov) (Laplace's approximation)."""
        members = tuple(initial_belief(model, fit, t_ns, measurements) for fit in fits)
        evidence = [-0.5 * fit.chi2 + 0.5 * float(np.linalg.slogdet(fit.cov)[1]) for fit in fits]
        return self._pruned(members, np.array(evidence))

    def predict(self, model: StateSpace, belief: Belief, joints: JointState) -> Belief:
        """Time update of every component."""
        bank = as_mixture(belief)
        return moment_matched(tuple(self.component_filter.predict(model, member, joints) for member in bank.members), bank.ln_weights)

    def update(self, model: StateSpace, belief: Belief, reading: GasReading) -> tuple[Belief, Innovation]:
        """Measurement update of every component and of the weights, by the likelihood; a reading that all of them gate changes nothing."""
        bank = as_mixture(belief)
        updated = [self.component_filter.update(model, member, reading) for member in bank.members]
        innovations = [innovation for _, innovation in updated]
        innovation = _mixture_innovation(np.exp(bank.ln_weights), innovations)
        if innovation.gated:
            return belief, innovation
        ln_likelihoods = [-0.5 * (min(i.nis, self.gate_nis) + float(np.log(i.cov[0, 0]))) for i in innovations]
        return self._pruned(tuple(member for member, _ in updated), bank.ln_weights + ln_likelihoods), innovation

    def _pruned(self, members: tuple[Belief, ...], ln_weights: Array) -> GaussianMixture:
        """Mixture with normalised weights, without the components below the least weight."""
        kept = np.flatnonzero(ln_weights - np.logaddexp.reduce(ln_weights) >= np.log(max(self.min_weight, 1e-300)))
        ln_kept = ln_weights[kept]
        return moment_matched(tuple(members[i] for i in kept), ln_kept - np.logaddexp.reduce(ln_kept))


def as_mixture(belief: Belief) -> GaussianMixture:
    """Return the belief as a Gaussian mixture; a single Gaussian becomes a mixture of one component."""
    return belief if isinstance(belief, GaussianMixture) else GaussianMixture(belief.t_ns, belief.mean, belief.cov, (belief,), np.zeros(1))


def moment_matched(members: tuple[Belief, ...], ln_weights: Array) -> GaussianMixture:
    """Return the mixture with its mean, sum w x, and covariance, sum w (P + (x - mean)(x - mean)')."""
    weights, means = np.exp(ln_weights), np.array([member.mean for member in members])
    mean = weights @ means
    cov = np.einsum("k,kij->ij", weights, [member.cov for member in members])
    deviations = means - mean
    cov = cov + np.einsum("k,ki,kj->ij", weights, deviations, deviations)
    return GaussianMixture(max(member.t_ns for member in members), mean, 0.5 * (cov + cov.T), members, ln_weights)


def _mixture_innovation(weights: Array, innovations: list[Innovation]) -> Innovation:
    """Innovation of the mixture: reading minus mean prediction, with the mixture's variance; gated if all components gated it."""
    residuals = np.array([innovation.residual[0] for innovation in innovations])
    variances = np.array([innovation.cov[0, 0] for innovation in innovations])
    residual = float(weights @ residuals)
    variance = float(weights @ (variances + (residuals - residual) ** 2))
    gated = all(innovation.gated for innovation in innovations)
    return Innovation(innovations[0].t_ns, np.array([residual]), np.array([[variance]]), gated)
