"""Prior of the filter before the search: calibrated by the stages, or cold from data sheets and nominal models."""

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from oio.core.records import Array
from oio.core.settings import Within, settings
from oio.gas.fluctuation import Fluctuation
from oio.gas.range_law import LN_STRENGTH, MAX_DISCREPANCY, MAX_NOSE_JITTER_M, SOURCE, RangeLaw
from oio.inference.forward_model import ParameterLayout
from oio.inference.map_fit import Fit
from oio.inference.process_noise import ProcessNoise
from oio.inference.state_space import StateSpace
from oio.inference.uncertainty import Noise
from oio.kinematics.arm import Arm

FIXED = 1e-6  # standard deviation, in its own unit, of a parameter that is taken as known


@dataclass(frozen=True, eq=False)
class Prior:
    """Prior of the batch parameters theta (mean (P,), cov (P, P)), and the state-space model of the filter."""

    mean: Array
    cov: Array
    model: StateSpace
    delay_s: float = 0.0  # time delay of the gas stamps [s]: see `oio.gas.timing`

    @property
    def layout(self) -> ParameterLayout:
        """Index layout of mean and cov."""
        return ParameterLayout(self.model.arm.dof, self.model.elements)


@settings
class Nominal:
    """Data-sheet values: lag [s], offsets and their standard uncertainty [ppm], specimen spread of gains and lags (standard deviation
    of ln), and time delay of the gas stamps [s]."""

    rise_s: Annotated[float, Within(1e-3, 3600)]
    fall_s: Annotated[float, Within(1e-3, 3600)]
    elements: Annotated[int, Within(1, 2)]
    background_ppm: Annotated[float, Within(0, 1e6)]
    accuracy_ppm: Annotated[float, Within(0, 1e6)]
    sigma_ppm: Annotated[float, Within(1e-9, 1e6)]
    gain_u: Annotated[float, Within(1e-6, 10)]
    tau_u: Annotated[float, Within(1e-6, 5)]
    delay_s: Annotated[float, Within(0, 10)]
    delay_u_s: Annotated[float, Within(0, 10)]  # standard uncertainty; 0: the delay is known, and calibration does not look for it


def nominal_prior(arm: Arm, law: RangeLaw, nominal: Nominal, offsets: Array, offsets_u: Array) -> tuple[Array, Array]:
    """Prior mean and cov of theta before any fit, with the source anywhere in the workspace box and ln strength unknown (see
    `reset_source`): a configured strength is that of the source to be found, and the first fit is of the beacon."""
    lay = ParameterLayout(arm.dof, nominal.elements)
    mean, sd = np.zeros(lay.size), np.zeros(lay.size)
    mean[lay.exponent], sd[lay.exponent] = law.exponent, law.exponent_u
    sd[lay.wind] = law.wind_per_m_u, law.wind_per_m_u, law.lift_per_m_u
    sd[lay.thinning] = law.thinning_per_m_u
    sd[lay.offset] = np.radians(np.hypot(arm.homing_u_deg, arm.backlash_deg / 2)) + FIXED
    sd[lay.drift] = np.radians(arm.encoder_drift_deg_s2) / np.sqrt(3.0) + 1e-9  # a bound is a rectangular distribution (GUM 4.3.7)
    sd[lay.gain] = nominal.gain_u
    sd[lay.gain.start] = FIXED  # the first element is the reference; the strength absorbs its gain
    sd[lay.tau] = nominal.tau_u
    mean[lay.baseline], sd[lay.baseline] = offsets, offsets_u
    return reset_source(mean, np.diag(sd**2), arm, law.with_unknown_strength())


def reset_source(mean: Array, cov: Array, arm: Arm, law: RangeLaw, ln_strength: float = 0.0) -> tuple[Array, Array]:
    """Return the prior with the source reset: rectangular over the workspace box on each axis, ln strength about `ln_strength`."""
    low, high = np.array(arm.box_low_m), np.array(arm.box_high_m)
    mean, cov = np.array(mean), np.array(cov)
    cov[: LN_STRENGTH + 1, :] = cov[:, : LN_STRENGTH + 1] = 0.0
    mean[SOURCE], mean[LN_STRENGTH] = (low + high) / 2, ln_strength
    cov[SOURCE, SOURCE][np.diag_indices(3)] = ((high - low) / 2) ** 2 / 3.0
    cov[LN_STRENGTH, LN_STRENGTH] = law.ln_strength_u**2
    return mean, cov


def cold_prior(arm: Arm, law: RangeLaw, process_noise: ProcessNoise, nominal: Nominal, pinned: bool = True) -> Prior:
    """Prior without calibration (cold start): nominal range law, unit gains, nominal lag and offsets, data-sheet noise.

    `pinned`: law, gains and lag are taken as known; else they are as open as where the fit on the beacon begins, which is the fair one to
    compare calibration with.
    """
    offsets = np.full(nominal.elements, nominal.background_ppm)
    fixed, figures = law, nominal
    if pinned:
        fixed = replace(law, exponent_u=FIXED, wind_per_m_u=FIXED, lift_per_m_u=FIXED, thinning_per_m_u=FIXED)
        figures = replace(nominal, gain_u=FIXED, tau_u=FIXED)
    mean, cov = nominal_prior(arm, fixed, figures, offsets, np.full(nominal.elements, nominal.accuracy_ppm))
    model = StateSpace(
        arm, law, process_noise, nominal.rise_s, nominal.fall_s, (1.0,) * nominal.elements,
        Fluctuation(1.0, law.fluctuation_intensity, law.eddy_s), nominal.sigma_ppm, Noise.nominal(),
    )  # fmt: skip
    return Prior(mean, cov, model, nominal.delay_s)


def calibrated_prior(fit: Fit, arm: Arm, process_noise: ProcessNoise, nominal: Nominal, noise: Noise) -> Prior:
    """Prior from the fit on the beacon (known source), with the source itself reset.

    If the errors of the repeats exceed their covariances, all noise of a reading is inflated alike: the next source is located with the
    same sensor in the same air.
    """
    inflation_sd = float(np.sqrt(noise.inflation))
    was = fit.fluctuation
    gas = replace(was, scale=noise.inflation * was.scale, gamma=inflation_sd * was.gamma, sway=inflation_sd * was.sway)
    jitter_m = min(inflation_sd * fit.law.nose_jitter_m, MAX_NOSE_JITTER_M)
    law = replace(fit.law, model_discrepancy=min(inflation_sd * fit.law.model_discrepancy, MAX_DISCREPANCY), nose_jitter_m=jitter_m)
    mean, cov = reset_source(fit.mean, noise.inflation * fit.cov, arm, fit.law)
    lay = fit.layout
    factor = float(np.exp(mean[lay.tau]))
    gain = tuple(float(g) for g in np.exp(mean[lay.gain]))
    model = StateSpace(arm, law, process_noise, nominal.rise_s * factor, nominal.fall_s * factor, gain, gas, nominal.sigma_ppm, noise)
    return Prior(mean, cov, model, nominal.delay_s)
