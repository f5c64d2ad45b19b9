"""Conformance tests of sensors and air models."""

import math

import numpy as np

from oio.core.interfaces import Air, LiveAir, Sensor, SensorUnit, SimulatedSensor
from oio.core.records import Array, GasSample
from oio.testing.assertions import require, require_bad_input, require_frozen

EXPOSURES_PPM = (100.0, 1000.0)  # low and high; every transduction law responds to such a step
VALUES = 20  # per element and exposure


def check_sensor(sensor: Sensor, ppm: tuple[float, ...] = (1.0, 10.0, 100.0)) -> None:
    """Check a sensor: valid timing, `raw` and `reading` are inverse at `ppm`, invalid samples are refused; a simulated unit, if there is
    one, responds to gas and is repeatable."""
    require_frozen(sensor)
    require(isinstance(sensor, Sensor), "a sensor has every member of `oio.core.interfaces.Sensor`.")
    require(sensor.name != "", "a sensor has a name.")
    require(sensor.elements in (1, 2), f"a sensor has 1 or 2 elements, not {sensor.elements}.")
    for key in ("sample_s", "tau_rise_s", "tau_fall_s", "settled_ppm_per_min"):
        require(0 < getattr(sensor, key) < math.inf, f"{key} is finite and greater than 0, not {getattr(sensor, key)}.")
    _check_law(sensor, ppm)
    for raw in (math.nan, math.inf, -math.inf):
        require_bad_input(f"a raw value of {raw}", sensor.reading, GasSample(0, 0, raw))
    for element in (-1, sensor.elements):
        require_bad_input(f"a sample of element {element}", sensor.reading, GasSample(0, element, sensor.raw(ppm[0])))
    if isinstance(sensor, SimulatedSensor):
        _check_unit(sensor)


def _check_law(sensor: Sensor, ppm: tuple[float, ...]) -> None:
    for element in range(sensor.elements):
        for i, value in enumerate(ppm):
            reading = sensor.reading(GasSample(7 + i, element, sensor.raw(value)))
            require(reading.t_ns == 7 + i and reading.element == element, "a reading keeps time and element of its sample.")
            require(
                math.isclose(reading.ppm, value, rel_tol=1e-6), f"raw and reading undo each other: {value} ppm came back as {reading.ppm}."
            )
            require(0 < reading.sigma_ppm < math.inf, f"sigma_ppm of a reading is finite and greater than 0, not {reading.sigma_ppm}.")


def _check_unit(sensor: SimulatedSensor) -> None:
    one, again = (sensor.unit(np.random.default_rng(1), np.random.default_rng(2)) for _ in range(2))
    values = _exposed(sensor, one)
    require(bool(np.all(np.isfinite(values))), "every value of a specimen is finite.")
    require(values.tobytes() == _exposed(sensor, again).tobytes(), "the same seeds give the same values of a specimen, bit for bit.")
    for e in range(sensor.elements):
        clean, gas = (np.mean([sensor.reading(GasSample(0, e, float(v))).ppm for v in values[i, e]]) for i in (0, 1))
        require(bool(gas > clean), f"element {e} of a specimen reads more in more gas: {clean} ppm became {gas}.")


def _exposed(sensor: Sensor, unit: SensorUnit) -> Array:
    """Raw values (exposures, elements, VALUES), each exposure a dozen time constants long."""
    t_s, out = 0.0, np.zeros((len(EXPOSURES_PPM), sensor.elements, VALUES))
    for i, ppm in enumerate(EXPOSURES_PPM):
        for _ in range(120):
            t_s += 0.1 * max(sensor.tau_rise_s, sensor.sample_s)
            unit.step(ppm, 0.1 * max(sensor.tau_rise_s, sensor.sample_s))
        for k in range(VALUES):
            for e in range(sensor.elements):
                t_s += sensor.sample_s
                unit.step(ppm, sensor.sample_s)
                out[i, e, k] = unit.sample(e, t_s)
    return out


SOURCE_M = np.array([0.3, 0.05, 0.2])


def check_air(air: Air) -> None:
    """Check an air model: no gas without a source; finite, not negative, linear in emission, thinner far away; repeatable by seed."""
    require_frozen(air)
    require(air.name != "", "air has a name.")
    live, again, double, other = (air.open(np.random.default_rng(1), np.random.default_rng(2)) for _ in range(4))
    require(live.ppm(SOURCE_M) == 0.0, "there is no gas before a source is presented.")
    near, far = _concentrations(live, 1.0, 0.03), _concentrations(other, 1.0, 0.5)
    require(bool(np.all(np.isfinite(near)) and np.all(near >= 0)), "a concentration is finite and never negative.")
    require(bool(np.mean(near) > np.mean(far)), f"gas thins with distance: {np.mean(near)} ppm at 3 cm, {np.mean(far)} ppm at 50 cm.")
    require(near.tobytes() == _concentrations(again, 1.0, 0.03).tobytes(), "the same seeds give the same gas, bit for bit.")
    require(np.allclose(2.0 * near, _concentrations(double, 2.0, 0.03), rtol=1e-9), "twice the emission is twice the concentration.")
    live.present(None, 0.0)
    live.step(0.05)
    require(live.ppm(SOURCE_M) == 0.0, "the old gas is aired out when there is no source any more.")


def _concentrations(live: LiveAir, emission_ml_s: float, away_m: float) -> Array:
    """Concentrations (40, 6) over two seconds on six sides of the source."""
    live.present(SOURCE_M, emission_ml_s)
    places = SOURCE_M + away_m * np.concatenate([np.eye(3), -np.eye(3)])
    out = []
    for _ in range(40):
        live.step(0.05)
        out.append([live.ppm(p) for p in places])
    return np.array(out)
