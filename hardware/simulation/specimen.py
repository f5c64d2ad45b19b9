"""Simulated specimen of a gas sensor: spread from the data sheet, lag, drift, warm-up, climate and noise.

Chain: ppm at the site -> first-order lag (rise and fall differ) -> transduction with the specimen's gain and offset, baseline drift,
warm-up transient, temperature, humidity, noise -> quantisation -> raw.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Protocol

import numpy as np

from oio.core.settings import Within, settings


@settings
class Spread:
    """Spread between specimens, drift and noise. `signal` is ppm for linear laws and ln(resistance) for metal oxides."""

    gain: Annotated[float, Within(0, 3)]  # 1-sigma of ln(sensitivity) between specimens
    bias: Annotated[float, Within(0, 1e6)]  # 1-sigma of the offset [signal]
    tau: Annotated[float, Within(0, 3)]  # 1-sigma of ln(lag) between specimens
    drift_per_sqrt_h: Annotated[float, Within(0, 1e6)]  # random walk [signal / sqrt(h)]
    warm_up: Annotated[float, Within(-1e6, 1e6)]  # amplitude of the switch-on transient [signal]
    noise: Annotated[float, Within(0, 1e6)]  # white noise per value [signal]
    per_degc: Annotated[float, Within(-1e4, 1e4)]  # temperature coefficient [signal / degC]
    per_pct_rh: Annotated[float, Within(-1e4, 1e4)]  # humidity coefficient [signal / %RH]


@settings
class Climate:
    """Room climate: slow swings of temperature and humidity about their values at calibration."""

    temperature_swing_degc: Annotated[float, Within(0, 50)]
    humidity_swing_pct: Annotated[float, Within(0, 100)]
    period_s: Annotated[float, Within(1, 1e7)]


class Timing(Protocol):
    """Protocol of a sensor's lag and warm-up [s]; `hardware.sensors.nose.Dynamics` is one."""

    @property
    def update_s(self) -> float:
        """Update period of one element."""
        ...

    @property
    def tau_rise_s(self) -> float:
        """First-order lag on a rise."""
        ...

    @property
    def tau_fall_s(self) -> float:
        """First-order lag on a fall."""
        ...

    @property
    def warm_up_tau_s(self) -> float:
        """Time constant of the switch-on transient."""
        ...

    @property
    def powered_for_s(self) -> float:
        """Time the sensor was already on when the world opened."""
        ...


class Transducer(Protocol):
    """Protocol of a sensor type: its raw-to-ppm law and its spread."""

    @property
    def elements(self) -> int:
        """1, or 2 that are sampled alternately."""
        ...

    @property
    def dynamics(self) -> Timing:
        """Lag and warm-up."""
        ...

    @property
    def spread(self) -> Spread:
        """Spread between specimens."""
        ...

    @property
    def climate(self) -> Climate:
        """Climate of the room."""
        ...

    def electronics(self, ppm: float, gain: float, signal: float) -> float:
        """Raw value (quantised) of an element with that gain factor, shifted by `signal`, whose material is exposed to `ppm`."""
        ...


@dataclass(slots=True)
class _Element:
    gain: float
    bias: float
    tau_factor: float
    lagged_ppm: float = math.nan
    drift: float = 0.0
    drifted_at_s: float = 0.0
    held_raw: float = math.nan
    held_since_s: float = -math.inf

    def drifted(self, per_sqrt_h: float, t_s: float, noise: np.random.Generator) -> float:
        """Random walk of the baseline at t_s, advanced only when a value is taken."""
        self.drift += per_sqrt_h * math.sqrt((t_s - self.drifted_at_s) / 3600.0) * noise.standard_normal()
        self.drifted_at_s = t_s
        return self.drift


class Specimen:
    """Simulated specimen; see the chain in the module's docstring."""

    def __init__(self, sensor: Transducer, truth: np.random.Generator, noise: np.random.Generator) -> None:
        s = sensor.spread
        self._sensor, self._noise, self._t_s, self._swings = sensor, noise, 0.0, 1.0
        tau = math.exp(s.tau * truth.standard_normal())  # the elements share a housing, hence their lag
        self._elements = [
            _Element(math.exp(s.gain * truth.standard_normal()), s.bias * truth.standard_normal(), tau) for _ in range(sensor.elements)
        ]

    def step(self, ppm: float, dt_s: float) -> None:
        """Expose every element to `ppm` for `dt_s`: exact zero-order hold of the first-order lag."""
        self.step_each((ppm,) * len(self._elements), dt_s)

    def step_each(self, ppm: Sequence[float], dt_s: float) -> None:
        """Expose each element to its own concentration for `dt_s`."""
        d = self._sensor.dynamics
        self._t_s += dt_s
        for element, here in zip(self._elements, ppm, strict=True):
            if math.isnan(element.lagged_ppm):
                element.lagged_ppm = here  # initially settled in this air
            tau = (d.tau_rise_s if here > element.lagged_ppm else d.tau_fall_s) * element.tau_factor
            element.lagged_ppm += (1.0 - math.exp(-dt_s / tau)) * (here - element.lagged_ppm)

    def renew_noise(self, noise: np.random.Generator) -> None:
        """Take the noise from another generator from now on."""
        self._noise = noise

    def scale_lag(self, factor: float) -> None:
        """Multiply the time constants by a factor from now on."""
        for element in self._elements:
            element.tau_factor *= factor

    def scale_climate(self, factor: float) -> None:
        """Multiply the swings of temperature and humidity by a factor from now on."""
        self._swings *= factor

    def sample(self, element: int, t_s: float) -> float:
        """Return the raw value at t_s; repeated until the element's update period has passed."""
        e, sensor = self._elements[element], self._sensor
        if t_s - e.held_since_s >= sensor.dynamics.update_s - 1e-6:
            drift = e.drifted(sensor.spread.drift_per_sqrt_h, self._t_s, self._noise)
            signal = e.bias + drift + self._slow_signal() + sensor.spread.noise * self._noise.standard_normal()
            e.held_raw, e.held_since_s = sensor.electronics(e.lagged_ppm, e.gain, signal), t_s
        return e.held_raw

    def _slow_signal(self) -> float:
        s, d, c = self._sensor.spread, self._sensor.dynamics, self._sensor.climate
        warm_up = s.warm_up * math.exp(-(self._t_s + d.powered_for_s) / d.warm_up_tau_s)
        swing = self._swings * math.sin(2 * math.pi * self._t_s / c.period_s)
        return warm_up + swing * (s.per_degc * c.temperature_swing_degc + s.per_pct_rh * c.humidity_swing_pct)
