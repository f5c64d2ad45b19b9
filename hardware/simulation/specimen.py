"""One simulated unit of a sensor: its spread from the data sheet, lag, drift, warm-up, climate and noise.

Chain: ppm at the site -> first-order lag (rise and fall differ) -> transduction with the specimen's gain and offset, baseline drift,
warm-up transient, temperature, humidity, noise -> quantisation -> raw.
"""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from oio.core.settings import settings


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


class Timing(Protocol):
    """Lag and warm-up of a sensor [s]; `hardware.sensors.nose.Dynamics` is one."""

    @property
    def update_s(self) -> float:
        """Between new values of one element."""
        ...

    @property
    def tau_rise_s(self) -> float:
        """First-order lag on a rise."""
        ...

    @property
    def tau_fall_s(self) -> float:
        """And on a fall."""
        ...

    @property
    def warm_up_tau_s(self) -> float:
        """Decay of the switch-on transient."""
        ...

    @property
    def powered_for_s(self) -> float:
        """How long it was on when the world opened."""
        ...


class Transducer(Protocol):
    """What a specimen is a specimen of: a sensor with its law and its figures of spread."""

    @property
    def elements(self) -> int:
        """1, or 2 that are read in turn."""
        ...

    @property
    def dynamics(self) -> Timing:
        """Timing."""
        ...

    @property
    def spread(self) -> Spread:
        """Between specimens."""
        ...

    @property
    def climate(self) -> Climate:
        """Of the room."""
        ...

    def electronics(self, ppm: float, gain: float, signal: float) -> float:
        """Raw value (quantised) of an element with that gain factor, shifted by `signal`, when its material feels `ppm`."""
        ...


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

    def __init__(self, sensor: Transducer, truth: np.random.Generator, noise: np.random.Generator) -> None:
        s = sensor.spread
        self._sensor, self._noise, self._t_s = sensor, noise, 0.0
        tau = math.exp(s.tau * truth.standard_normal())  # twins share a housing, hence their lag
        self._elements = [
            _Element(math.exp(s.gain * truth.standard_normal()), s.bias * truth.standard_normal(), tau) for _ in range(sensor.elements)
        ]

    def step(self, ppm: float, dt_s: float) -> None:
        """Expose every element to `ppm` for `dt_s`: exact hold of the first-order lag."""
        d = self._sensor.dynamics
        self._t_s += dt_s
        for element in self._elements:
            if math.isnan(element.feels_ppm):
                element.feels_ppm = ppm  # it has stood in this air for long
            tau = (d.tau_rise_s if ppm > element.feels_ppm else d.tau_fall_s) * element.tau_factor
            element.feels_ppm += (1.0 - math.exp(-dt_s / tau)) * (ppm - element.feels_ppm)

    def sample(self, element: int, t_s: float) -> float:
        """The value on the wire at t_s; repeated until the element's update time has passed."""
        e, sensor = self._elements[element], self._sensor
        if t_s - e.held_since_s >= sensor.dynamics.update_s - 1e-6:
            drift = e.drifted(sensor.spread.drift_per_sqrt_h, self._t_s, self._noise)
            signal = e.bias + drift + self._slow() + sensor.spread.noise * self._noise.standard_normal()
            e.held, e.held_since_s = sensor.electronics(e.feels_ppm, e.gain, signal), t_s
        return e.held

    def _slow(self) -> float:
        s, d, c = self._sensor.spread, self._sensor.dynamics, self._sensor.climate
        warm_up = s.warm_up * math.exp(-(self._t_s + d.powered_for_s) / d.warm_up_tau_s)
        swing = math.sin(2 * math.pi * self._t_s / c.period_s)
        return warm_up + swing * (s.per_degc * c.temperature_swing_degc + s.per_pct_rh * c.humidity_swing_pct)
