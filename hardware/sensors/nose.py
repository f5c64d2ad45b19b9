"""Base class of all gas sensors: timing, raw-to-ppm law, data sheet figures. A simulated unit is a `Specimen`."""

import math
from abc import ABC, abstractmethod
from typing import Annotated

import numpy as np

from hardware.simulation.specimen import Climate, Specimen, Spread
from oio.core.errors import BadInput
from oio.core.records import GasReading, GasSample
from oio.core.settings import Within, settings


@settings
class Dynamics:
    """Timing of one profile (`paper` or `datasheet`)."""

    sample_s: Annotated[float, Within(0.02, 600)]  # sampling period of the alternating pair [s]
    update_s: Annotated[float, Within(0.02, 600)]  # update period of one element [s]; polling faster repeats the last value
    tau_rise_s: Annotated[float, Within(1e-3, 3600)]  # first-order lag when the concentration rises [s]
    tau_fall_s: Annotated[float, Within(1e-3, 3600)]  # first-order lag when it falls [s]
    warm_up_tau_s: Annotated[float, Within(1e-3, 1e6)]  # time constant of the switch-on transient [s]
    powered_for_s: Annotated[float, Within(0, 1e9)]  # time the sensor was already on when the world opens [s]


@settings
class Nose(ABC):
    """Base class of gas sensors; a subclass is a `@settings` class with the law: `raw`, `ppm_from_raw`, `sigma_ppm`, `electronics`."""

    name: str
    gas: str  # target gas
    elements: Annotated[int, Within(1, 2)]  # 1, or 2 that are sampled alternately
    background_ppm: Annotated[float, Within(0, 1e6)]  # background concentration of that gas in the room [ppm]
    emission_ml_s: Annotated[float, Within(0, 1e4)]  # emission rate of a source, pure gas [ml/s] (1 ml/s is 1 ppm m^3/s)
    accuracy_ppm: Annotated[float, Within(0, 1e6)]  # standard uncertainty of an uncalibrated reading in clean air
    resolution_ppm: Annotated[float, Within(1e-9, 1e6)]  # white noise of one reading in clean air
    settled_ppm_per_min: Annotated[float, Within(1e-9, 1e6)]  # slope below which warm-up is over
    # no_value: ranges of raw values, ends included, that mean `no measurement`
    no_value: Annotated[tuple[tuple[float, float], ...], Within(-1e12, 1e12)]
    dynamics: Dynamics
    spread: Spread
    climate: Climate

    def check(self) -> None:
        """Refuse ranges of no_value whose ends are swapped."""
        for low, high in self.no_value:
            if low > high:
                raise BadInput(
                    f"sensor.no_value has the range [{low:g}, {high:g}], but the lower end comes first. Type [{high:g}, {low:g}]."
                )

    def is_no_value(self, raw: float) -> bool:
        """Whether a raw value is the device's way of saying that it has none."""
        return any(low <= raw <= high for low, high in self.no_value)

    @property
    def sample_s(self) -> float:
        """Sampling period [s]."""
        return self.dynamics.sample_s

    @property
    def tau_rise_s(self) -> float:
        """Nominal first-order lag on a rise [s]."""
        return self.dynamics.tau_rise_s

    @property
    def tau_fall_s(self) -> float:
        """Nominal first-order lag on a fall [s]."""
        return self.dynamics.tau_fall_s

    def reading(self, sample: GasSample) -> GasReading:
        """Convert a raw sample to ppm with the standard deviation of its white noise; nominal law, no calibration. Raises BadInput."""
        if not math.isfinite(sample.raw) or not 0 <= sample.element < self.elements:
            raise BadInput(
                f"a sample of element {sample.element} with raw={sample.raw} reached sensor '{self.name}' ({self.elements} elements)."
            )
        ppm = self.ppm_from_raw(sample.raw)
        return GasReading(sample.t_ns, sample.element, ppm, self.sigma_ppm(ppm), sample.raw <= self.lowest_raw)

    @property
    def lowest_raw(self) -> float:
        """Lower rail of the electronics: a value there is censored, the concentration may be lower."""
        return 0.0

    @property
    def highest_raw(self) -> float:
        """Upper rail, or the end of the scale: a value there is not a measurement and reaches no stage."""
        return math.inf

    def unit(self, truth: np.random.Generator, noise: np.random.Generator) -> Specimen:
        """Create a simulated specimen: its spread is drawn from `truth`, its noise from `noise`."""
        return Specimen(self, truth, noise)

    @abstractmethod
    def raw(self, ppm: float) -> float:
        """Convert ppm to raw for a nominal unit, before quantisation."""
        ...

    @abstractmethod
    def ppm_from_raw(self, raw: float) -> float:
        """Convert raw to ppm for a nominal unit."""
        ...

    @abstractmethod
    def sigma_ppm(self, ppm: float) -> float:
        """Standard deviation of one reading's white noise at that concentration [ppm], quantisation included."""
        ...

    @abstractmethod
    def electronics(self, ppm: float, gain: float, signal: float) -> float:
        """Raw value (quantised) of an element with that gain factor, shifted by `signal`, whose material is exposed to `ppm`."""
        ...
