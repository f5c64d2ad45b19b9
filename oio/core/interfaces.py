"""What a world, a sensor and a room's air must offer, and no more. `oio.testing` has one conformance suite for each."""

from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager
from typing import Protocol, runtime_checkable

import numpy as np

from oio.core.records import Array, GasReading, GasSample, WorldSample


class World(Protocol):
    """Something live: it yields samples in time order and takes commands. Made only by `Backend.open`."""

    @property
    def t_ns(self) -> int:
        """Nanoseconds since the world opened; the time of everything yielded so far is at most this."""
        ...

    def samples(self, for_s: float) -> Iterator[WorldSample]:
        """Let `for_s` seconds pass; yield what was sensed, in time order. Raises `WorldEnded` when there is no more."""
        ...

    def move(self, q_rad: Array, over_s: float) -> float:
        """Begin a smooth move of the n unlocked joints to q_rad (n,), meant to last `over_s`; it happens while samples flow.

        Returns the seconds it lasts: a replay's arm moves as it once did.
        """
        ...

    def present(self, source: str) -> None:
        """Open one gas source: `none`, `beacon` (known place, calibration) or `source` (unknown place, the search)."""
        ...


@runtime_checkable
class Backend(Protocol):
    """A frozen description of a world."""

    def open(self) -> AbstractContextManager[World]:
        """Make it live; the only place where anything does I/O."""
        ...


@runtime_checkable
class RealTime(Protocol):
    """Optional protocol of a backend whose worlds go on by themselves, by the clock on the wall: benches."""

    real_time: bool


@runtime_checkable
class Sensor(Protocol):
    """A transduction principle with its numbers: raw to ppm and back, lag, noise, timing."""

    @property
    def name(self) -> str:
        """The choice `sensor=NAME`."""
        ...

    @property
    def elements(self) -> int:
        """Number of elements: 1, or 2."""
        ...

    @property
    def sample_s(self) -> float:
        """Seconds between samples (one element each time, unless the two are sampled together)."""
        ...

    @property
    def tau_rise_s(self) -> float:
        """Nominal first-order lag when the concentration rises [s]."""
        ...

    @property
    def tau_fall_s(self) -> float:
        """Nominal first-order lag when it falls [s]."""
        ...

    @property
    def settled_ppm_per_min(self) -> float:
        """Slope [ppm/min] below which warm-up is over."""
        ...

    @property
    def highest_raw(self) -> float:
        """The upper end of the scale, or infinity: a value there is no measurement."""
        ...

    def reading(self, sample: GasSample) -> GasReading:
        """Raw to ppm with the white-noise standard deviation of one reading; nominal law, no calibration."""
        ...

    def raw(self, ppm: float) -> float:
        """The inverse of `reading`'s law for a nominal unit, before quantisation."""
        ...


class SensorUnit(Protocol):
    """A simulated sensor: all its elements, with their spread, lag, drift and noise."""

    def step(self, ppm: float, dt_s: float) -> None:
        """Expose every element to `ppm` for `dt_s`."""
        ...

    def sample(self, element: int, t_s: float) -> float:
        """The raw value that the sensor's electronics would put on the wire at t_s, by the world's clock."""
        ...


@runtime_checkable
class PlacedUnit(Protocol):
    """Optional protocol of a simulated sensor whose elements may be at different places."""

    def step_each(self, ppm: Sequence[float], dt_s: float) -> None:
        """Expose each element to its own concentration `ppm` for `dt_s`."""
        ...


@runtime_checkable
class SimulatedSensor(Sensor, Protocol):
    """A sensor of which specimens can be simulated."""

    def unit(self, truth: np.random.Generator, noise: np.random.Generator) -> SensorUnit:
        """A simulated specimen: its spread is drawn from `truth`, its noise from `noise`."""
        ...


class LiveAir(Protocol):
    """Moving gas in one room."""

    def present(self, source_m: Array | None, emission_ml_s: float) -> None:
        """Replace the source: (3,) m in the base frame, or none; the new plume has already developed for the time that the YAML gives."""
        ...

    def step(self, dt_s: float) -> None:
        """Advance the gas."""
        ...

    def ppm(self, p_m: Array) -> float:
        """Concentration above background at (3,) m."""
        ...


@runtime_checkable
class Air(Protocol):
    """A frozen description of a room's air."""

    name: str

    def open(self, truth: np.random.Generator, disturbance: np.random.Generator) -> LiveAir:
        """Make it live: wind direction and other constants from `truth`, turbulence from `disturbance`."""
        ...
