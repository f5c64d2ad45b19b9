"""What every gas sensor has: timing, a law, a spread between specimens; and `Specimen`, one simulated unit of it.

Chain of a specimen: ppm at the site -> first-order lag (rise and fall differ) -> transduction with the specimen's gain and offset,
baseline drift, warm-up transient, temperature, humidity, noise -> quantisation -> raw.
"""

import math
from dataclasses import dataclass

import numpy as np

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
class Spread:
    """How specimens differ and wander. `signal` is ppm for linear laws and ln(resistance) for metal oxides."""

    gain: float  # 1-sigma of ln(sensitivity) between specimens
    bias: float  # 1-sigma of the offset [signal]
    tau: float  # 1-sigma of ln(lag) between specimens
    drift_per_sqrt_h: float  # random walk [signal / sqrt(h)]
    warm_up: float  # height of the switch-on transient [signal]
    noise: float  # white noise per value [signal]
    per_degc: float  # temperature coefficient [signal / degC]
    per_pct_rh: float  # humidity coefficient [signal / %RH]


@settings
class Climate:
    """The room: slow swings of temperature and humidity about the values at which the sensor was calibrated."""

    temperature_swing_degc: float
    humidity_swing_pct: float
    period_s: float


@settings
class Nose:
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

    def unit(self, truth: np.random.Generator, noise: np.random.Generator) -> "Specimen":
        """A simulated specimen: its spread is drawn from `truth`, its noise from `noise`."""
        return Specimen(self, truth, noise)

    def raw(self, ppm: float) -> float:
        """ppm to raw of a nominal unit, before quantisation."""
        raise TypeError(f"{type(self).__name__} gives no raw()")

    def ppm_from_raw(self, raw: float) -> float:
        """Raw to ppm of a nominal unit."""
        raise TypeError(f"{type(self).__name__} gives no ppm_from_raw()")

    def sigma_ppm(self, ppm: float) -> float:
        """White noise of one reading [ppm] at that concentration, quantisation included."""
        raise TypeError(f"{type(self).__name__} gives no sigma_ppm()")

    def electronics(self, ppm: float, gain: float, signal: float) -> float:
        """Raw value (quantised) of an element with that gain factor, shifted by `signal`, when its material feels `ppm`."""
        raise TypeError(f"{type(self).__name__} gives no electronics()")


@dataclass(slots=True)
class _Element:
    gain: float
    bias: float
    tau_factor: float
    feels_ppm: float = math.nan
    drift: float = 0.0
    drifted_at_s: float = 0.0
    held: float = math.nan
    held_since_s: float = -math.inf

    def drifted(self, per_sqrt_h: float, t_s: float, noise: np.random.Generator) -> float:
        """The random walk of the baseline at t_s; it is only looked at when a value is taken, so only then is it walked on."""
        self.drift += per_sqrt_h * math.sqrt((t_s - self.drifted_at_s) / 3600.0) * noise.standard_normal()
        self.drifted_at_s = t_s
        return self.drift


class Specimen:
    """One simulated unit; see the module's chain."""

    def __init__(self, nose: Nose, truth: np.random.Generator, noise: np.random.Generator) -> None:
        s = nose.spread
        self._nose, self._noise, self._t_s = nose, noise, 0.0
        tau = math.exp(s.tau * truth.standard_normal())  # twins share a housing, hence their lag
        self._elements = [
            _Element(math.exp(s.gain * truth.standard_normal()), s.bias * truth.standard_normal(), tau) for _ in range(nose.elements)
        ]

    def step(self, ppm: float, dt_s: float) -> None:
        """Expose every element to `ppm` for `dt_s`: exact hold of the first-order lag."""
        d = self._nose.dynamics
        self._t_s += dt_s
        for element in self._elements:
            if math.isnan(element.feels_ppm):
                element.feels_ppm = ppm  # it has stood in this air for long
            tau = (d.tau_rise_s if ppm > element.feels_ppm else d.tau_fall_s) * element.tau_factor
            element.feels_ppm += (1.0 - math.exp(-dt_s / tau)) * (ppm - element.feels_ppm)

    def sample(self, element: int, t_s: float) -> float:
        """The value on the wire at t_s; repeated until the element's update time has passed."""
        e, nose = self._elements[element], self._nose
        if t_s - e.held_since_s >= nose.dynamics.update_s - 1e-6:
            drift = e.drifted(nose.spread.drift_per_sqrt_h, self._t_s, self._noise)
            signal = e.bias + drift + self._slow() + nose.spread.noise * self._noise.standard_normal()
            e.held, e.held_since_s = nose.electronics(e.feels_ppm, e.gain, signal), t_s
        return e.held

    def _slow(self) -> float:
        s, d, c = self._nose.spread, self._nose.dynamics, self._nose.climate
        warm_up = s.warm_up * math.exp(-(self._t_s + d.powered_for_s) / d.warm_up_tau_s)
        swing = math.sin(2 * math.pi * self._t_s / c.period_s)
        return warm_up + swing * (s.per_degc * c.temperature_swing_degc + s.per_pct_rh * c.humidity_swing_pct)
