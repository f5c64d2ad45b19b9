"""Wrong arrays are refused at the door, in one paragraph that says what was given and what is wanted."""

import numpy as np
import pytest

import oio

T = np.arange(5.0)
SETUP = oio.Setup(sensor="ndir", dof=3)
BOX_M = [[-0.5, -0.5, -0.5], [0.5, 0.5, 0.5]]


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: oio.Readings(T, ppm=np.ones(4)), r"Readings.ppm has the shape \(4,\), but \(5,\) is wanted"),
        (lambda: oio.Readings(T, ppm=np.ones((5, 1))), r"shape \(5, 1\), but \(5,\)"),
        (lambda: oio.Readings(T), "neither ppm nor raw"),
        (lambda: oio.Readings(T, ppm=T, raw=T), "both ppm and raw"),
        (lambda: oio.Readings([], ppm=[]), "Readings.t_s is empty"),
        (lambda: oio.Readings(T, ppm=[1, 2, np.nan, 4, 5]), "1 of 5 rows that are no finite numbers, the first is row 2"),
        (lambda: oio.Readings(T, ppm=[1, 2, "three", 4, 5]), "cannot be read as an array of numbers"),
        (lambda: oio.Readings(T, ppm=np.ma.masked_equal([1, -999, 3, 4, 5], -999)), "Readings.ppm has 1 masked values"),
        (lambda: oio.Readings(T * np.timedelta64(1, "ms"), ppm=T), r"Readings.t_s has the type timedelta64\[ms\].*Give seconds"),
        (lambda: oio.Readings(np.datetime64("2026-01-01T00:00:00") + np.arange(5), ppm=T), r"the type datetime64\[s\]"),
        (lambda: oio.Readings(T, ppm=T + 1j), "complex numbers"),
        (lambda: oio.Readings(T, ppm=[[1, 2], [3]]), "cannot be read as an array of numbers"),
        (lambda: oio.Readings(T[::-1], ppm=T), "must not decrease, but 3.000000 s in row 1 comes after 4.000000 s"),
        (lambda: oio.Readings(T - 1.0, ppm=T), "from -1 to 3 s, but 0 to"),
        (lambda: oio.Readings(T + 1.7e18, ppm=T), "Subtract the time of the beginning"),
        (lambda: oio.Readings(T, ppm=T, element=0.5), "element indices are 0, 1"),
        (lambda: oio.Readings(T, ppm=T, element=[-1, 0, 0, 0, 0]), "such as -1"),
        (lambda: oio.Readings(T, ppm=T, sigma_ppm=0.0), "greater than 0"),
        (lambda: oio.Readings(T, ppm=T).between(7, 9), "no reading from 7 to 9 s; there are some from 0 to 4 s"),
        (lambda: oio.JointPath(T, np.ones(5)), r"JointPath.q has the shape \(5,\), but \(5, n\) is wanted"),
        (lambda: oio.JointPath([0, 1, 1], np.ones((3, 2))), "must increase, but 1.000000 s in row 2 comes after 1.000000 s"),
        (lambda: oio.NosePath(T, np.ones((5, 2))), r"NosePath.p_m has the shape \(5, 2\), but \(5, 3\) is wanted"),
        (lambda: oio.NosePath(T, np.full((5, 3), np.inf)), "5 of 5 rows"),
        (lambda: oio.locate(oio.Readings(T, ppm=T), oio.JointPath(T, np.ones((5, 3)))), "neither a calibration nor a setup"),
        (lambda: oio.locate(oio.Readings(T, ppm=T), oio.JointPath(T, np.ones((5, 2))), setup=SETUP), r"\(k, 3\) is wanted.*dof=2"),
        (lambda: oio.locate(oio.Readings(T + 1, ppm=T + 400), oio.JointPath(T, np.ones((5, 3))), setup=SETUP), "poses from 0 to 4 s"),
        (lambda: oio.locate(oio.Readings(T, ppm=T, element=1), oio.JointPath(T, np.ones((5, 3))), setup=SETUP), "element 1 was given"),
        (lambda: oio.locate(oio.Readings(T, raw=T + 1e6), oio.JointPath(T, np.ones((5, 3))), setup=SETUP), "upper end of the sensor"),
        (lambda: oio.NosePath(T, np.full((5, 3), 250.0)), "p_m has values up to 250, but m are wanted, 99 at most. Divide mm by 1000"),
        (lambda: oio.locate(T, oio.NosePath(T, np.ones((5, 3))), setup=SETUP), r"readings is a ndarray, but a Readings is wanted"),
        (lambda: oio.locate(oio.Readings(T, ppm=T), T, setup=SETUP), "poses is a ndarray, but a JointPath is wanted"),
        (
            lambda: oio.locate(oio.Readings(T, ppm=T), oio.NosePath(T, np.ones((5, 3))), setup="ndir"),
            "setup is a str, but a Setup is wanted",
        ),
        (lambda: oio.Odometry("calibration.yaml"), "calibration is a str, but a Calibration is wanted"),
        (lambda: oio.write_calibration(SETUP, "a.yaml"), "calibration is a Setup, but a Calibration is wanted"),
        (lambda: oio.Odometry(setup=SETUP.without_arm()), "box_m is needed without an arm"),
        (lambda: SETUP.boxed([[-np.inf, 0, 0], [1, 1, 1]]), "box_m has 1 of 2 rows that are no finite numbers, the first is row 0. Give f"),
        (lambda: SETUP.boxed([[-500, 0, 0], [500, 100, 100]]), "box_m is from .* but m are wanted, 99 at most. Divide mm by 1000"),
        (lambda: oio.Readings(T, ppm=T > 2), "ppm holds True and False, but numbers are wanted"),
        (lambda: oio.NosePath(T, [[0.3] * 3, [0.31] * 3, [0] * 3, [0.31] * 3, [0.3] * 3]), "p_m is 0, 0, 0 in 1 rows, the first at 2 s"),
        (lambda: oio.Setup(overrides=["dof=3"]), "overrides is a list, but a Mapping is wanted"),
        (lambda: oio.Odometry(setup=SETUP).reading(0.0, ppm=[430, 431]), r"reading: ppm is \[430, 431\], but one number"),
        (lambda: oio.Odometry(setup=SETUP.without_arm(), box_m=BOX_M).joints(0.0, [100, 50, 0]), "Divide mm by 1000"),
        (
            lambda: oio.locate(oio.Readings(T, ppm=T), oio.JointPath(T, np.full((5, 3), 30.0)), setup=SETUP),
            "has 30 rad, far beyond the limits",
        ),
        (
            lambda: oio.calibrate(
                oio.Readings(T, ppm=T), oio.NosePath(T, np.ones((5, 3))), [100, 50, 0], clean_air_s=(-1, 1), beacon_s=(1, 4)
            ),
            "110 m from the nearest place of the nose",
        ),
        (lambda: SETUP.part("nominl"), "'nominl' was asked for, but the configuration has nothing under this key. Give 'nominal'"),
        (lambda: SETUP.boxed([[0, 0, 0]]), r"box_m has the shape \(1, 3\), but \(2, 3\) is wanted.$"),
        (lambda: SETUP.boxed([[0, 0, 0], [1, 0, 1]]), "a size on every axis"),
        (lambda: SETUP.boxed([0, 0, 0, 1, 1, 1]), r"\(2, 3\) is wanted"),
        (lambda: oio.Setup(sensor="ndri"), "ndir"),
        (lambda: oio.Setup(overrides={"nominal.rise": 1.0}), "nominal.rise"),
        (lambda: oio.Setup(overrides={"nominal.delay_s": object()}), "can be a number, a text"),
        (lambda: oio.Setup(overrides={"nominal.delay_s": -1.0}), "nominal.delay_s is -1, but 0 to 10 is allowed"),
        (lambda: oio.simulate(backend="replay"), "only mujoco is simulated"),
        (lambda: oio.simulate(logging="summary"), "read from the log"),
        (lambda: oio.simulate(dof=4), "dof=4 is not on the ladder"),
        (lambda: oio.simulate(stage=["warm_pu"]), "warm_up"),
        (lambda: oio.load_run("nowhere"), "no such file or folder"),
        (lambda: oio.load_calibration("nowhere.yaml"), "cannot be read"),
    ],
)
def test_one_paragraph_says_what_was_given_and_what_is_wanted(make, said):
    with pytest.raises(oio.BadInput, match=said) as refused:
        make()
    assert "\n" not in str(refused.value) and len(str(refused.value)) < 600


@pytest.mark.parametrize(
    ("feed", "said"),
    [
        (lambda o: o.joints(2.0, [0, 0]), r"joints: q has the shape \(2,\), but \(3,\) is wanted"),
        (lambda o: o.joints(2.0, [0, 0, np.nan]), "no finite numbers"),
        (lambda o: o.joints(1.0, [0, 0, 0]), "twice"),
        (lambda o: o.joints(0.5, [0, 0, 0]), "must not decrease"),
        (lambda o: o.joints(np.nan, [0, 0, 0]), "no finite numbers"),
        (lambda o: o.reading(0.5, 420.0), "must not decrease"),
        (lambda o: o.reading(2.0), "neither ppm nor raw"),
        (lambda o: o.reading(2.0, 1.0, raw=1.0), "both ppm and raw"),
        (lambda o: o.reading(2.0, 1.0, element=2), "element 2 was given, but sensor 'ndir' has 1"),
        (lambda _: oio.Odometry(), "neither a calibration nor a setup"),
        (lambda _: oio.Odometry(setup=SETUP, assembly="gmu").locate(), "before any joints"),
    ],
)
def test_a_sample_that_does_not_fit_is_refused_by_the_odometry(feed, said):
    odometry = oio.Odometry(setup=SETUP)
    odometry.joints(1.0, [0.0, -1.0, 0.6])
    with pytest.raises(oio.BadInput, match=said):
        feed(odometry)


def test_too_few_readings_say_so():
    with pytest.raises(oio.NotObservable, match="fewer than two readings"):
        oio.locate(oio.Readings([1.0], ppm=[420.0]), oio.JointPath(T, np.ones((5, 3))), setup=SETUP)


def test_a_missed_or_saturated_reading_is_no_error_in_a_loop():
    odometry = oio.Odometry(setup=SETUP)
    odometry.joints(1.0, [0.0, -1.0, 0.6])
    assert odometry.reading(1.0, ppm=np.nan) is None and odometry.reading(1.0, raw=40_000.0) is None
    assert odometry.source() is None and odometry.nose() is None and odometry.belief is None


def test_readings_in_a_hole_of_a_path_are_refused():
    t_s = np.concatenate([np.arange(0.0, 20.0, 0.1), np.arange(40.0, 60.0, 0.1)])
    path = oio.NosePath(t_s, np.column_stack([0.01 * t_s, 0 * t_s, 0 * t_s]))
    readings = oio.Readings(np.arange(1.0, 59.0), ppm=np.full(58, 420.0))
    with pytest.raises(oio.BadInput, match=r"a hole from 19.9 to 40 s, .* and 20 readings are in such holes"):
        oio.locate(readings, path, setup=SETUP)
    assert len(readings.only((readings.t_s <= 19.9) | (readings.t_s >= 40))) == 38


def test_a_reading_beyond_the_scale_of_the_sensor_is_no_measurement():
    odometry = oio.Odometry(setup=SETUP.without_arm(), box_m=BOX_M)
    for i, ppm in enumerate([420.0, 65535.0, 430.0, 440.0]):
        odometry.joints(0.1 * i, [0.01 * i, 0.0, 0.0])
        assert odometry.reading(0.1 * i, ppm) is None
    assert len(odometry._filter.trace) == 3
    assert len(oio.Readings(T, ppm=[420, 65535, 430, 440, 1e6]).records(SETUP.nose, 1.0)) == 3
