"""The conformance suites find what breaks a promise."""

import contextlib
import itertools
import time
from dataclasses import dataclass, field

import numpy as np
import pytest

from oio.core.errors import BadInput
from oio.core.records import GasReading, GasSample, JointState
from oio.testing import check_air, check_backend, check_live_backend, check_sensor


@dataclass(frozen=True)
class Sniffer:
    """A sensor with raw = 2 ppm, that breaks one promise."""

    how: str = ""
    name: str = "sniffer"
    elements: int = 1
    sample_s: float = 0.1
    tau_rise_s: float = 0.5
    tau_fall_s: float = 0.5
    settled_ppm_per_min: float = 1.0
    highest_raw: float = float("inf")

    def raw(self, ppm):
        return 2.0 * ppm

    def reading(self, sample):
        if self.how != "careless" and (not np.isfinite(sample.raw) or sample.element != 0):
            raise BadInput(f"a sample of element {sample.element} with raw={sample.raw}")
        factor = 0.6 if self.how == "skewed" else 0.5
        return GasReading(sample.t_ns, sample.element, factor * sample.raw, 0.0 if self.how == "sure" else 0.1)

    def unit(self, truth, noise):
        return Unit(self, np.random.default_rng() if self.how == "moody" else noise)


class Unit:
    def __init__(self, sensor, noise):
        self.sensor, self.noise, self.ppm = sensor, noise, 0.0

    def step(self, ppm, dt_s):
        self.ppm = 1.0 if self.sensor.how == "dead" else ppm

    def sample(self, element, t_s):
        return self.sensor.raw(self.ppm) + (0.0 if self.sensor.how == "dead" else self.noise.standard_normal())


@pytest.mark.parametrize(
    ("how", "said"),
    [
        ("skewed", "raw and reading undo each other"),
        ("sure", "sigma_ppm of a reading is finite and greater than 0"),
        ("careless", "a raw value of nan is not refused"),
        ("moody", "same seeds give the same values"),
        ("dead", "reads more in more gas"),
    ],
)
def test_a_bad_sensor_is_found(how, said):
    check_sensor(Sniffer())
    with pytest.raises(AssertionError, match=said):
        check_sensor(Sniffer(how))


def test_a_sensor_that_can_be_changed_is_found():
    @dataclass
    class Soft(Sniffer.__base__):
        name: str = "soft"

    with pytest.raises(AssertionError, match="can be changed after it was built"):
        check_sensor(Soft())


@dataclass(frozen=True)
class Room:
    """Air with gas as 1 / r, that breaks one promise."""

    how: str = ""
    name: str = "room"

    def open(self, truth, disturbance):
        return Gas(self.how, np.random.default_rng() if self.how == "moody" else disturbance)


class Gas:
    def __init__(self, how, rng):
        self.how, self.rng, self.source, self.emission, self.gust = how, rng, None, 0.0, 1.0

    def present(self, source_m, emission_ml_s):
        if source_m is not None or self.how != "stale":
            self.source, self.emission = source_m, min(emission_ml_s, 1.0) if self.how == "capped" else emission_ml_s

    def step(self, dt_s):
        self.gust = np.exp(0.1 * self.rng.standard_normal())

    def ppm(self, p_m):
        if self.source is None:
            return 0.0
        r = np.linalg.norm(p_m - self.source) + 0.01
        return float(self.emission * self.gust * (r if self.how == "inverted" else 1 / r)) * (-1.0 if self.how == "negative" else 1.0)


@pytest.mark.parametrize(
    ("how", "said"),
    [
        ("moody", "same gas"),
        ("stale", "aired out"),
        ("capped", "twice the concentration"),
        ("inverted", "thins"),
        ("negative", "never negative"),
    ],
)
def test_bad_air_is_found(how, said):
    check_air(Room())
    with pytest.raises(AssertionError, match=said if how != "moody" else "same seeds give the same gas"):
        check_air(Room(how))


@dataclass(frozen=True)
class Bench:
    """A backend of 50 Hz joints and 10 Hz gas, that breaks one promise."""

    how: str = ""
    live: bool = False
    opened: list = field(default_factory=list)

    @contextlib.contextmanager
    def open(self):
        if self.opened and self.how == "shut":
            raise BadInput("the port is in use")
        self.opened.append(1)
        yield (Going if self.live else Live)(self.how, len(self.opened))


class Live:
    def __init__(self, how, opening):
        self.how, self.opening, self.t_ns = how, opening, 0

    def present(self, source):
        if source not in ("none", "beacon", "source") and self.how != "easy":
            raise BadInput(f"there is no source '{source}'")

    def move(self, q_rad, over_s): ...

    def samples(self, for_s):
        for i in itertools.count(1):
            if i > round(for_s / 0.02):
                return
            self.t_ns += 0 if self.how == "stuck" else 20_000_000
            late = 50_000_000 if self.how == "backward" and i == 7 else -1_000_000_000 if self.how == "early" else 0
            q = np.nan if self.how == "lost" else self.opening if self.how == "moody" else 0.0
            yield JointState(self.t_ns - late, [q], [0.0], [0.0])
            if i % 5 == 0 and self.how != "odourless":
                yield GasSample(self.t_ns, 0, 1.0)


@pytest.mark.parametrize(
    ("how", "said"),
    [
        ("stuck", "lets time pass"),
        ("backward", "time order"),
        ("early", "no sample is of the future"),
        ("lost", "joints are finite"),
        ("moody", "opened again gives the same samples"),
        ("odourless", "gas comes in within"),
        ("easy", "a source that the world does not have is not refused"),
    ],
)
def test_a_bad_backend_is_found(how, said):
    check_backend(Bench())
    with pytest.raises(AssertionError, match=said):
        check_backend(Bench(how))


class Going(Live):
    """Its time goes on; what was sensed meanwhile comes first."""

    def __init__(self, how, opening):
        super().__init__(how, opening)
        self._left = time.monotonic()

    def samples(self, for_s):
        away_s = time.monotonic() - self._left
        yield from super().samples(for_s + (0.0 if self.how == "deaf" else away_s))
        self._left = time.monotonic()


@pytest.mark.parametrize(
    ("how", "said"),
    [("deaf", "while nobody asked"), ("backward", "time order"), ("odourless", "gas comes in within"), ("easy", "not refused")],
)
def test_a_bad_live_backend_is_found(how, said):
    check_live_backend(Bench(live=True), away_s=0.1)
    with pytest.raises(AssertionError, match=said):
        check_live_backend(Bench(how, live=True), away_s=0.1)
    with pytest.raises(BadInput, match="in use"):
        check_live_backend(Bench("shut", live=True), away_s=0.1)
