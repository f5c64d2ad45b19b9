"""The paper's EKF, taken literally: no lag, drift or fluctuation in the state; the reading is the concentration at the nose."""

from typing import Annotated

import numpy as np

from oio.core.records import Array, Belief, GasReading, Innovation, JointState, seconds
from oio.core.settings import Within, settings
from oio.estimators.gated_update import gated_update
from oio.gas.range_law import LAW, concentration
from oio.inference.state_space import StateSpace


@settings
class PaperEkf:
    """The paper's EKF: estimates source, ln strength and element offsets only; the encoders are taken as exact."""

    gate_nis: Annotated[float, Within(1, 1e9)]  # a reading whose NIS is larger is not used (chi-square, 1 degree of freedom)

    def predict(self, model: StateSpace, belief: Belief, joints: JointState) -> Belief:
        """Time update of a static source: only Q is added. The concentration at the nose is stored in state f for the update."""
        at, dt_s = model.at, seconds(joints.t_ns - belief.t_ns)
        mean, cov = np.array(belief.mean), np.array(belief.cov)
        p = model.arm.nose(joints.q)
        s = at["s"].start
        c, _, _, _ = concentration(p[None, :], mean[s : s + LAW], model.law.r_ref_m, model.law.radius_m)
        mean[at["f"]] = c[0]
        mean[at["o"]] = mean[at["v"]] = mean[at["a"]] = 0.0
        cov[at["s"], at["s"]] += model.noise.source_q_m2 * (dt_s if model.noise.assembly == "gum" else 1.0) * np.eye(3)
        return Belief(joints.t_ns, mean, _restricted_covariance(model, cov, p, mean))

    def update(self, model: StateSpace, belief: Belief, reading: GasReading) -> tuple[Belief, Innovation]:
        """Measurement update: condition source, strength and offset on one reading."""
        return gated_update(model, belief, reading, self.gate_nis)


def _restricted_covariance(model: StateSpace, cov: Array, p: Array, mean: Array) -> Array:
    """Covariance in which f is the linearised concentration, and only source, strength and offsets are uncertain."""
    at, s = model.at, model.at["s"].start
    estimated = np.zeros(model.size)
    estimated[at["s"]], estimated[at["l"]], estimated[at["b"]] = 1.0, 1.0, 1.0
    c, grad, _, _ = concentration(p[None, :], mean[s : s + LAW], model.law.r_ref_m, model.law.radius_m)
    transform = np.diag(estimated)
    transform[at["f"], s : s + 4] = c[0] * grad[0, :4]
    new = transform @ cov @ transform.T + 1e-18 * np.eye(model.size)
    return np.asarray(0.5 * (new + new.T))
