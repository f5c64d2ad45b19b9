"""What reaches the trace and what counts for consistency: readings that are numbers."""

import math
from dataclasses import replace

import numpy as np
import pytest

from oio.core.records import GasReading, Innovation, JointState, nanoseconds
from oio.estimators.odometry import Odometry

SILENT = [(math.nan, 0.05), (math.inf, 0.05), (-math.inf, 0.05), (1.0, math.nan), (1.0, math.inf)]


def fed(odometry, sniffs, spoilt=()):
    """Joints and readings of a trace in turn, each followed by the readings that are no numbers; the innovations of the latter."""
    due, out = dict(zip(sniffs.at.tolist(), range(len(sniffs.at)), strict=True)), []
    for i, (t_s, q) in enumerate(zip(sniffs.t_s, sniffs.q, strict=True)):
        odometry.joints(JointState(nanoseconds(t_s), q, 0 * q, 0 * q))
        if i in due:
            r = due[i]
            sound = GasReading(nanoseconds(t_s), int(sniffs.element[r]), float(sniffs.ppm[r]), float(sniffs.sigma_ppm[r]))
            odometry.reading(sound)
            out += [odometry.reading(replace(sound, ppm=ppm, sigma_ppm=sigma)) for ppm, sigma in spoilt]
    return out


@pytest.fixture
def begun(lab, built):
    """An odometry with a map, and what is sensed from then on."""
    made = lab(3, 1, seed=31)
    sniffs = made.problem(made.theta(), poses=8).sniffs

    def make():
        odometry = Odometry(built("ekf"), made.known, built("belief_map"))
        fed(odometry, sniffs.between(0.0, 10.0))
        odometry.locate(5)
        return odometry

    return make, sniffs.between(10.05, np.inf)


def test_a_reading_that_is_no_number_is_as_none(begun):
    make, rest = begun
    clean, spoilt = make(), make()
    fed(clean, rest)
    innovations = fed(spoilt, rest, SILENT)
    assert all(innovation.gated and innovation.residual[0] == 0.0 for innovation in innovations)
    assert len(spoilt.trace) == len(clean.trace)
    np.testing.assert_array_equal(spoilt.belief.mean, clean.belief.mean)
    np.testing.assert_array_equal(spoilt.belief.cov, clean.belief.cov)
    for limit in np.geomspace(0.01, 100.0, 40):
        assert spoilt.consistent(limit) == clean.consistent(limit)
    np.testing.assert_array_equal(spoilt.locate(8)[0].mean, clean.locate(8)[0].mean)


def test_before_the_first_map_it_is_dropped(lab, built):
    made = lab(3, 1, seed=32)
    odometry = Odometry(built("ekf"), made.known, built("belief_map"))
    odometry.joints(JointState(0, made.arm.home, np.zeros(3), np.zeros(3)))
    for ppm, sigma in SILENT:
        assert odometry.reading(GasReading(0, 0, ppm, sigma)) is None
    assert len(odometry.trace) == 0


class Surprised:
    """A filter that leaves the belief as it is; the NIS of every reading is its ppm."""

    def predict(self, model, belief, joints):
        return belief

    def update(self, model, belief, reading):
        return belief, Innovation(reading.t_ns, [np.sqrt(reading.ppm)], [[1.0]], False)


@pytest.fixture
def consistent(lab, built):
    """Whether an odometry is consistent, mean NIS below 3, after readings of these NIS; "map" makes another map."""
    made = lab(3, 1, seed=31)
    sniffs = made.problem(made.theta(), poses=8).sniffs

    def after(*nis):
        odometry = Odometry(Surprised(), made.known, built("belief_map"))
        fed(odometry, sniffs)
        odometry.locate(5)
        t_ns = nanoseconds(float(sniffs.t_s[-1]))
        for i, value in enumerate(nis, start=1):
            if value == "map":
                odometry.locate(5, odometry.hypotheses)
            else:
                odometry.reading(GasReading(t_ns + i, 0, value, 1.0))
        return odometry.consistent(3.0)

    return after


@pytest.fixture
def verified(lab, built):
    """Whether the readings speak for it."""
    made = lab(3, 1, seed=31)

    def after(*nis):
        odometry = Odometry(Surprised(), made.known, built("belief_map"))
        odometry._nis.extend(nis)
        return odometry.verified(3.0)

    return after


def test_consistency_is_judged_by_the_latest_thirty_readings(consistent):
    """Twenty large ones are in the window still, and outweigh ten small ones after them; beyond thirty they are forgotten."""
    assert not consistent(*[5.0] * 20, *[0.0] * 10)
    assert consistent(*[5.0] * 20, *[0.0] * 20) and consistent(*[100.0] * 20, *[2.9] * 30)
    assert not consistent(*[100.0], *[2.0] * 29) and consistent(*[100.0], *[2.0] * 30)


def test_a_map_does_not_empty_the_window(consistent):
    """A map that explains the readings which contradicted the belief before it has foreseen none of them."""
    assert not consistent(*[24.0] * 20, "map") and not consistent(*[24.0] * 20, "map", *[1.0] * 5)
    assert consistent(*[24.0] * 20, "map", *[1.0] * 30)


def test_fewer_than_ten_readings_are_no_evidence(consistent, verified):
    assert consistent(*[9.0] * 9) and not consistent(*[9.0] * 10)
    assert not verified(*[1.0] * 9) and verified(*[1.0] * 10) and not verified(*[3.0] * 10)
