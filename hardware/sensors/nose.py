"""The base of all sensors: timing, a law between ppm and raw, figures from the data sheet. A simulated unit is a `Specimen`."""

import math
from abc import ABC, abstractmethod

import numpy as np

from hardware.simulation.specimen import Climate, Specimen, Spread
from oio.core.errors import BadInput
from oio.core.records import GasReading, GasSample
from oio.core.settings import in_range, settings


@settings
class Dynamics:
    """Timing of one profile (`paper` or `datasheet`)."""

    sample_s: float  # s between samples of the alternating pair
    update_s: float  # s between new values of one element; polling faster repeats the old one
    tau_rise_s: float  # s, first-order lag when the concentration rises
    tau_fall_s: float  # s, and when it falls
    warm_up_tau_s: float  # s, decay of the switch-on transient
    powered_for_s: float  # s the sensor was already on when the world opens

    def check(self) -> None:
        """Refuse senseless times."""
        in_range(self, sample_s=(0.02, 600), update_s=(0.02, 600), tau_rise_s=(1e-3, 3600), tau_fall_s=(1e-3, 3600))
        in_range(self, warm_up_tau_s=(1e-3, 1e6), powered_for_s=(0, 1e9))


@settings
class Nose(ABC):
    """Base of all sensors; a subclass is a `@settings` class that gives the law: `raw`, `ppm_from_raw`, `sigma_ppm`, `electronics`."""

    name: str
    gas: str  # what it is meant to smell
    elements: int  # 1, or 2 that are read in turn
    background_ppm: float  # of that gas in the room
    emission_ml_s: float  # pure gas that a source lets out (1 ml/s is 1 ppm m^3/s)
    accuracy_ppm: float  # standard uncertainty of an uncalibrated reading in clean air
    resolution_ppm: float  # white noise of one reading in clean air
    settled_ppm_per_min: float  # slope below which warm-up is over
    dynamics: Dynamics
    spread: Spread
    climate: Climate

    def check(self) -> None:
        """Refuse a senseless number of elements and negative amounts."""
        in_range(
            self,
            elements=(1, 2),
            background_ppm=(0, 1e6),
            emission_ml_s=(0, 1e4),
            accuracy_ppm=(0, 1e6),
            resolution_ppm=(1e-9, 1e6),
            settled_ppm_per_min=(1e-9, 1e6),
        )

    @property
    def sample_s(self) -> float:
        """Seconds between samples."""
        return self.dynamics.sample_s

    @property
    def tau_rise_s(self) -> float:
        """Nominal lag on a rise [s]."""
        return self.dynamics.tau_rise_s

    @property
    def tau_fall_s(self) -> float:
        """Nominal lag on a fall [s]."""
        return self.dynamics.tau_fall_s

    def reading(self, sample: GasSample) -> GasReading:
        """Raw to ppm with the white-noise standard deviation of one reading; nominal law, no calibration."""
        if not math.isfinite(sample.raw) or not 0 <= sample.element < self.elements:
            raise BadInput(
                f"a sample of element {sample.element} with raw={sample.raw} reached sensor '{self.name}' ({self.elements} elements)."
            )
        ppm = self.ppm_from_raw(sample.raw)
        return GasReading(sample.t_ns, sample.element, ppm, self.sigma_ppm(ppm), sample.raw <= self.lowest_raw)

    @property
    def lowest_raw(self) -> float:
        """The electronics' lower rail: a value there says only that the concentration is not more than that."""
        return 0.0

    @property
    def highest_raw(self) -> float:
        """The upper rail, or the end of the scale: a value there is no measurement, and no stage sees it."""
        return math.inf

    def unit(self, truth: np.random.Generator, noise: np.random.Generator) -> Specimen:
        """A simulated specimen: its spread is drawn from `truth`, its noise from `noise`."""
        return Specimen(self, truth, noise)

    @abstractmethod
    def raw(self, ppm: float) -> float:
        """ppm to raw of a nominal unit, before quantisation."""
        ...

    @abstractmethod
    def ppm_from_raw(self, raw: float) -> float:
        """Raw to ppm of a nominal unit."""
        ...

    @abstractmethod
    def sigma_ppm(self, ppm: float) -> float:
        """White noise of one reading [ppm] at that concentration, quantisation included."""
        ...

    @abstractmethod
    def electronics(self, ppm: float, gain: float, signal: float) -> float:
        """Raw value (quantised) of an element with that gain factor, shifted by `signal`, when its material feels `ppm`."""
        ...
