"""What is no measurement, or cannot be one, is left out, counted and told: in a fit of arrays, and in another program's loop."""

import warnings

import numpy as np
import pytest

import oio
from oio.api.samples import NO_VALUE, SCALE_END

SETUP = oio.Setup(sensor="ndir")
SOURCE_M, BOX_M = np.array([-0.05, 0.08, 0.10]), [[-0.5] * 3, [0.5] * 3]
T_S = np.arange(0.0, 30.0, 0.1)
PLACES_M = 0.25 * np.sin(np.outer(T_S, [0.5, 0.37, 0.23]) + np.array([0.0, 1.0, 2.0]))


def sensed():
    """Readings (m,) [ppm] of a source of 10 ppm m through a lag of 0.35 s."""
    gas_ppm, ppm = 10.0 / np.linalg.norm(PLACES_M - SOURCE_M, axis=1), np.zeros(len(T_S))
    for i in range(1, len(T_S)):
        ppm[i] = ppm[i - 1] + (gas_ppm[i] - ppm[i - 1]) * (1.0 - np.exp(-0.1 / 0.35))
    return 432.0 + ppm + np.random.default_rng(1).standard_normal(len(T_S))


def located(ppm, kept=slice(None)):
    """The place that `oio.locate` finds, and what it warned of."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always", oio.LeftOut)
        readings = oio.Readings(T_S[kept], ppm=ppm[kept])
        found = oio.locate(readings, oio.NosePath(T_S, PLACES_M), setup=SETUP, box_m=BOX_M)
    assert all(one.filename == __file__ for one in said)  # it points at who called, as a warning should
    return found.mean_m, [str(one.message) for one in said if one.category is oio.LeftOut]


@pytest.mark.parametrize(("value", "why"), [(0.0, NO_VALUE), (65535.0, SCALE_END)])
def test_what_is_no_measurement_does_not_move_the_source(value, why):
    """A dead SCD30 says 0 ppm; many loggers say 65535. A stretch of it is longer than any glitch."""
    wrong = np.zeros(len(T_S), dtype=bool)
    wrong[100:150] = True
    place, said = located(np.where(wrong, value, sensed()))
    assert said == [f"50 readings are left out: {value:g} ppm, {why}; the first at 10.0 s"]
    expected, nothing = located(sensed(), ~wrong)
    assert nothing == []
    np.testing.assert_array_equal(place, expected)


def test_nothing_but_no_measurement_is_refused():
    said = r"none of the 300 readings from 0\.0 s on is a measurement: 300 are the sensor's sign.*one that is dead"
    with pytest.raises(oio.BadInput, match=said):
        located(np.zeros(len(T_S)))
    with pytest.raises(oio.BadInput, match=r"150 are the sensor's sign .*; 150 are at the upper end of the sensor's scale"):
        located(np.repeat([0.0, 65535.0], 150))


def fed(ppm, kept):
    """The loop of another program: joints at every time, and its readings."""
    odometry = oio.Odometry(setup=SETUP.without_arm(), box_m=BOX_M)
    for i, t_s in enumerate(T_S.tolist()):
        odometry.joints(t_s, PLACES_M[i])
        if kept[i]:
            odometry.reading(t_s, ppm=float(ppm[i]))
    return odometry


def test_a_loop_counts_what_is_no_measurement():
    ppm, kept = sensed(), np.arange(len(T_S)) % 20 != 7
    wrong = fed(np.where(kept, ppm, 0.0), np.ones(len(T_S), dtype=bool))
    right = fed(ppm, kept)
    assert wrong.left_out == {NO_VALUE: 15} and right.left_out == {}
    np.testing.assert_array_equal(wrong.locate().mean_m, right.locate().mean_m)


def test_a_loop_takes_glitches_out_of_the_fit():
    kept = np.ones(len(T_S), dtype=bool)
    kept[[120, 200]] = False
    ppm = np.where(kept, sensed(), [300.0 if i == 120 else 2000.0 for i in range(len(T_S))])
    odometry = fed(ppm, np.ones(len(T_S), dtype=bool))
    with pytest.warns(oio.LeftOut, match="2 readings are left out as glitches"):
        found = odometry.locate()
    assert odometry.left_out == {"glitch": 2}
    np.testing.assert_array_equal(found.mean_m, fed(sensed(), kept).locate().mean_m)
