"""`Calibration`: what was learnt at a source of known place, as arrays; read from and written to a calibration.yaml."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from oio.api.array_input import expected
from oio.api.setup import Setup
from oio.core.errors import BadInput
from oio.core.records import Array
from oio.gas.range_law import LAW
from oio.inference.prior import Prior, calibrated_prior, cold_prior
from oio.kinematics.arm import Arm
from oio.results.calibration_fit import parameter_names, parameter_units
from oio.results.kept_calibration import KeptCalibration
from oio.results.yaml_fields import Fields, plain_yaml

EXAMPLE = "Give the calibration.yaml of a run, or what oio.write_calibration wrote."


@dataclass(frozen=True, eq=False)
class Calibration:
    """A calibration: `text` is its file, and all else is read from it. Units stand in the names.

    `names`, `units`, `mean` (P,), `cov` (P, P): all fitted parameters, source law first (the source's place there is the beacon's).
    """

    text: str
    setup: Setup
    kept: KeptCalibration

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the fitted parameters, (P,) of them."""
        return parameter_names(self.kept.joints, self.kept.fit.layout.elements)

    @property
    def units(self) -> tuple[str, ...]:
        """Units of the fitted parameters, (P,) of them."""
        return parameter_units(self.setup.robot.units, self.kept.fit.layout.elements)

    @property
    def mean(self) -> Array:
        """Fitted parameters (P,)."""
        return np.array(self.kept.fit.mean)

    @property
    def cov(self) -> Array:
        """Covariance of the fitted parameters (P, P)."""
        return np.array(self.kept.fit.cov)

    @property
    def law(self) -> dict[str, tuple[float, float]]:
        """Source law: value and standard uncertainty of ln_strength, exponent, wind_x, wind_y, wind_z and thinning."""
        sd = np.sqrt(np.diag(self.kept.fit.cov))
        return {self.names[i]: (float(self.kept.fit.mean[i]), float(sd[i])) for i in range(3, LAW)}

    @cached_property
    def _prior(self) -> Prior:
        return self.prior()

    @property
    def lag_s(self) -> tuple[float, float]:
        """First-order lag of the sensor [s], as the concentration rises and as it falls."""
        return self._prior.model.rise_s, self._prior.model.fall_s

    @property
    def delay_s(self) -> float:
        """By how much readings are stamped late [s]; negative: by how much poses are, in a log of two devices."""
        return self.kept.delay.s

    @property
    def offset_ppm(self) -> Array:
        """Offsets of the elements (E,) [ppm]: what they read in clean air."""
        return np.array(self.kept.fit.mean[self.kept.fit.layout.baseline])

    @property
    def gain(self) -> Array:
        """Gains of the elements (E,); that of the first is 1."""
        return np.array(self._prior.model.gain)

    @property
    def R_ppm2(self) -> float:
        """Variance of one reading in clean air [ppm^2]; in gas its fluctuation is added."""
        model = self._prior.model
        return float(model.fluctuation.scale * model.sigma_ppm**2)

    @property
    def Q(self) -> Array:
        """Process noise (N, N) that one second adds to the filter's state, whose entries are `state_names`."""
        return np.diag(self._prior.model.process_noise_diagonal(1.0))

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the entries of the filter's state, (N,) of them."""
        return self._prior.model.names

    @property
    def verdict(self) -> str:
        """PASS, WARN or FAIL: what the calibration thought of itself."""
        return self.kept.verdict

    @property
    def reasons(self) -> tuple[str, ...]:
        """Sentences on what does not pass."""
        return Fields(plain_yaml(self.text, self.kept.file, EXAMPLE), self.kept.file).section("verdict").texts("reasons")

    def prior(self, arm: Arm | None = None, assembly: str = "gum") -> Prior:
        """What a filter starts from, for this arm (None: that of the setup), with Q and R in an assembly: gum or paper."""
        if assembly not in self.kept.noises:
            raise BadInput(f"assembly is '{assembly}', but it can be gum or paper.")
        nominal = replace(self.setup.part("nominal"), delay_s=max(self.kept.delay.s, 0.0))
        return calibrated_prior(
            self.kept.fit, arm or self.setup.robot, self.setup.part("process_noise"), nominal, self.kept.noises[assembly]
        )


def prior_of(calibration: Calibration | None, setup: Setup, arm: Arm, assembly: str = "gum") -> Prior:
    """Return the prior of a calibration, or without one that of data sheets and nominal models, as open as before a calibration."""
    if calibration is not None:
        return calibration.prior(arm, assembly)
    return cold_prior(arm, setup.part("range_law"), setup.part("process_noise"), setup.part("nominal"), pinned=False)


def chosen_setup(calibration: Calibration | None, setup: Setup | None) -> Setup:
    """Return the setup of a calibration, or the one that is given without one. Raises BadInput for neither, and for both."""
    expected("calibration", calibration, Calibration, "oio.load_calibration('calibration.yaml')", optional=True)
    expected("setup", setup, Setup, "oio.Setup(sensor='ec')", optional=True)
    if (calibration is None) == (setup is None):
        given = "neither a calibration nor a setup" if calibration is None else "a calibration and a setup"
        raise BadInput(f"{given} was given, but it takes one of them: a calibration has its setup. Give e.g. setup=oio.Setup(sensor='ec').")
    if calibration is not None:
        return calibration.setup
    assert setup is not None
    return setup
