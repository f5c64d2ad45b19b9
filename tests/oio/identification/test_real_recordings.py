"""What the real recordings say, each in one number: drift without a floor, a warm-up of a quarter of an hour, twins, a noisy sensor."""

import os
from pathlib import Path

import numpy as np
import pytest

from oio.identification.allan import allan_curve
from oio.identification.allan_fit import fit_allan
from oio.identification.element_noise import element_noise
from oio.identification.regular_series import regular
from oio.identification.settling import settling
from oio.identification.stationarity import kpss, trend
from oio.identification.twin_elements import averaging, relation

DATA = Path(os.environ.get("OIO_DATA", "data"))
pytestmark = pytest.mark.skipif(not (DATA / "orebro3dsen").is_dir(), reason="no recordings here: OIO_DATA names no folder that has them")


@pytest.fixture
def rows(built):
    """rows("airscout32", ...) are the rows of a recording."""
    return lambda name, *changes: built("recording", f"recording={name}", *changes).load()


@pytest.mark.parametrize("unit", ["ticks", "ppm"])
def test_the_deviation_of_a_lived_in_room_rises_from_the_first_tau_and_has_no_floor(rows, unit):
    """There is no white part: it rises from 10 s to 5.7 h, and only the last tau, half a day, is flat within its interval."""
    loaded = rows("sgp30_64h", f"recording.unit={unit}")
    for value in loaded.ppm.T:
        fit = fit_allan(allan_curve(regular(loaded.t_s, value)))
        deviation = fit.curve.deviation
        assert np.all(np.diff(deviation[:-1]) > 0.0) and deviation[-1] < fit.curve.high[-2]
        assert fit.coefficients["B"].value is None and fit.coefficients["K"].value > 0.0
    if unit == "ticks":
        assert fit_allan(allan_curve(regular(loaded.t_s, loaded.ppm[:, 0]))).curve.deviation[[0, -2]] == pytest.approx(
            [7.0, 310.0], rel=0.05
        )


def test_the_warm_up_of_a_metal_oxide_takes_a_quarter_of_an_hour(rows):
    loaded = rows("airscout32")
    found = settling(loaded.t_s, loaded.ppm[:, 1])
    assert 10 * 60 < found.tau_s < 25 * 60 and found.tau_low_s > 10 * 60 and found.tau_high_s < 25 * 60
    assert not kpss(loaded.ppm[:, 1]).stationary and not trend(loaded.t_s, loaded.ppm[:, 1]).vanishes


def test_averaging_two_units_beats_one_only_after_offsets_are_removed(rows):
    """VYV and 21kv against the mean of the other two."""
    ppm = rows("co2_scd30x4", "recording.columns=[VYU,VYV,21kv,VZ2]").ppm
    found = averaging(ppm[:, 1], ppm[:, 2], 0.5 * (ppm[:, 0] + ppm[:, 3]))
    assert not found.helps and found.helps_no_offset


def test_units_of_one_type_differ_in_gain_by_a_tenth(rows):
    """Of VYV, 21kv and VZ2 relative to VYU: gains 1.13, 1.02 and 1.20, as by a fit against the mean of the four."""
    ppm = rows("co2_scd30x4", "recording.columns=[VYU,VYV,21kv,VZ2]").ppm
    found = [relation(ppm[:, 0], other) for other in ppm.T[1:]]
    assert [r.gain for r in found] == pytest.approx([1.13, 1.02, 1.20], abs=0.02)
    assert all(r.gain_half_width < 0.1 for r in found)


@pytest.mark.parametrize("run", ["Exp01.csv.gz", "Exp06.csv.gz"])
def test_one_sensor_of_27_is_noisy(rows, run):
    loaded = rows("orebro3dsen", f"recording.calibration={run}")
    clean = loaded.ppm[loaded.t_s < loaded.release_s]
    assert [name for name, noise in zip(loaded.columns, element_noise(clean), strict=True) if noise.noisy] == ["C_102"]


@pytest.mark.parametrize("name", ["airscout32", "co2_scd30x4", "scd30_windows", "sgp30_64h", "smellnet", "waag_ec"])
def test_every_recording_has_a_curve_and_a_sensor_that_is_slow_to_settle_is_found_so(rows, name):
    loaded = rows(name)
    curve = allan_curve(regular(loaded.t_s, loaded.ppm[:, 0]))
    assert np.all(curve.low < curve.deviation) and np.all(curve.deviation < curve.high)
