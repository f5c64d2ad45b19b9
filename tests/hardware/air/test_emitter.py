"""Sources of any shape fill it evenly, and release over time what their schedule says; several of them add up."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hardware.air.emitter import SHAPES, Emitter, Release, Shape
from hardware.air.filament import Filament

SOURCE = np.array([0.3, 0.05, 0.2])
AXES = st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda axis: np.linalg.norm(axis) > 0.1)


@given(st.sampled_from(SHAPES), st.floats(0.001, 0.5), AXES, st.integers(-1000, 1000))
def test_every_shape_is_centred_and_no_larger_than_its_size(kind, size_m, axis, first):
    offsets = Shape(kind, size_m, axis).offsets_m(first, 400)
    assert offsets.shape == (400, 3) and np.max(np.linalg.norm(offsets, axis=1)) <= size_m * (1 + 1e-9)
    np.testing.assert_allclose(offsets.mean(axis=0), 0.0, atol=0.02 * size_m)
    along = offsets @ (np.array(axis) / np.linalg.norm(axis))
    if kind in ("ring", "disc"):
        np.testing.assert_allclose(along, 0.0, atol=1e-9)
    if kind == "line":
        np.testing.assert_allclose(np.abs(along), np.linalg.norm(offsets, axis=1), atol=1e-9)


def test_a_disc_is_filled_evenly_and_a_ring_is_empty():
    disc, ring = (np.linalg.norm(Shape(kind, 0.1, (0.0, 0.0, 1.0)).offsets_m(0, 4000), axis=1) for kind in ("disc", "ring"))
    assert np.mean(disc < 0.05) == pytest.approx(0.25, abs=0.02)  # a quarter of the area
    np.testing.assert_allclose(ring, 0.1)


def test_numbers_of_puffs_go_on_where_they_ended():
    shape = Shape("disc", 0.1, (1.0, 0.0, 0.0))
    np.testing.assert_array_equal(shape.offsets_m(0, 20), np.concatenate([shape.offsets_m(0, 7), shape.offsets_m(7, 13)]))


def test_release_fades_pulses_and_starts():
    t = np.array([-5.0, 0.0, 2.0, 7.0, 100.0])
    np.testing.assert_array_equal(Release().share(t), np.ones(5))
    np.testing.assert_allclose(Release(fade_s=100.0).share(t), np.exp(-np.maximum(t, 0.0) / 100.0))
    np.testing.assert_array_equal(Release(pulse_s=10.0, duty=0.6).share(t), [1.0, 1.0, 1.0, 0.0, 1.0])
    np.testing.assert_array_equal(Release(starts_s=5.0).share(t), [0.0, 0.0, 0.0, 1.0, 1.0])


def opened(air):
    return air.open(np.random.default_rng(1), np.random.default_rng(2))


def many_puffs(**changes):
    plain = {
        "name": "room", "wind_m_s": 0.0, "turbulence_m_s": 0.05, "eddy_s": 0.4, "meander_m_s": 0.01, "meander_s": 5.0, "puffs_per_s": 100.0,
        "puff_m": 0.01, "growth_m2_s": 2.0e-4, "age_s": 30.0, "range_m": 10.0, "spin_up_s": 30.0,
    }  # fmt: skip
    return Filament(**{**plain, **changes})


def mean_ppm(live, p_m, seconds_s=20.0):
    values = []
    for _ in range(round(seconds_s / 0.05)):
        live.step(0.05)
        values.append(live.ppm(p_m))
    return float(np.mean(values))


def test_a_plain_emitter_is_a_source_bit_for_bit():
    one, other = opened(many_puffs()), opened(many_puffs())
    one.present(SOURCE, 0.7)
    other.emit((Emitter(SOURCE, 0.7),))
    for _ in range(20):
        one.step(0.05)
        other.step(0.05)
    assert one.ppm(SOURCE + 0.05) == other.ppm(SOURCE + 0.05) > 0


def test_two_sources_add_up_and_share_the_meander():
    live, p = opened(many_puffs()), SOURCE + np.array([0.0, 0.06, 0.0])
    live.emit((Emitter(SOURCE, 1.0), Emitter(SOURCE + np.array([0.0, 0.12, 0.0]), 1.0)))
    alone = opened(many_puffs())
    alone.present(SOURCE, 1.0)
    assert mean_ppm(live, p) == pytest.approx(2.0 * mean_ppm(alone, p), rel=0.25)
    swaying = opened(many_puffs(turbulence_m_s=0.0, growth_m2_s=0.0))
    swaying.emit((Emitter(np.zeros(3), 1.0), Emitter(np.ones(3), 1.0)))
    first, second = swaying.places_m[:3000], swaying.places_m[3000:6000]
    np.testing.assert_allclose(second - first, 1.0, atol=1e-5)


def test_the_weaker_source_has_as_many_puffs_of_less_gas():
    live = opened(many_puffs())
    live.emit((Emitter(SOURCE, 1.0), Emitter(SOURCE + 0.5, 0.25)))
    near = opened(many_puffs())
    near.present(SOURCE + 0.5, 0.25)
    p = SOURCE + 0.5 + np.array([0.05, 0.0, 0.0])
    assert mean_ppm(live, p, 60.0) == pytest.approx(mean_ppm(near, p, 60.0), rel=0.3)


def test_a_fading_source_fades(built):
    for air in (many_puffs(age_s=10.0, spin_up_s=10.0), built("air", "air=steady")):
        live, steady = opened(air), opened(air)
        live.emit((Emitter(SOURCE, 1.0, release=Release(fade_s=20.0)),))
        steady.present(SOURCE, 1.0)
        p = SOURCE + np.array([0.05, 0.0, 0.0])
        mean_ppm(live, p, 40.0), mean_ppm(steady, p, 40.0)
        assert mean_ppm(live, p, 5.0) / mean_ppm(steady, p, 5.0) == pytest.approx(np.exp(-42.0 / 20.0), rel=0.35)


def test_a_late_source_is_not_there_at_first():
    live = opened(many_puffs())
    live.emit((Emitter(SOURCE, 1.0, release=Release(starts_s=2.0)),))
    p = SOURCE + np.array([0.03, 0.0, 0.0])
    assert mean_ppm(live, p, 1.9) == 0.0 < mean_ppm(live, p, 3.0)


def test_a_ring_in_steady_air_is_the_mean_of_its_points(built):
    live = opened(built("air", "air=steady"))
    live.emit((Emitter(SOURCE, 1.0, Shape("ring", 0.05, (0.0, 0.0, 1.0))),))
    point = opened(built("air", "air=steady"))
    point.present(SOURCE, 1.0)
    on_the_axis = SOURCE + np.array([0.0, 0.0, 0.12])
    at_13_cm = SOURCE + np.array([0.13, 0.0, 0.0])
    assert live.ppm(on_the_axis) == pytest.approx(point.ppm(at_13_cm), rel=1e-6)


def test_wind_that_is_set_carries_the_puffs_from_then_on():
    live = opened(many_puffs(turbulence_m_s=0.0, meander_m_s=0.0, spin_up_s=0.0, wind_m_s=0.05))
    before = live.wind_m_s.copy()
    live.set_wind(0.05, np.pi / 2, 0.01)
    assert before @ live.wind_m_s == pytest.approx(0.0, abs=1e-12) and live.wind_m_s[2] == 0.01
    live.present(SOURCE, 1.0)
    for _ in range(40):
        live.step(0.05)
    oldest = live.places_m[0] - SOURCE
    np.testing.assert_allclose(oldest / np.linalg.norm(oldest), live.wind_m_s / np.linalg.norm(live.wind_m_s), atol=1e-3)


def test_meander_that_is_set_shakes_the_plume(built):
    live = opened(replace(many_puffs(), meander_m_s=0.0))
    live.set_meander(0.1, 5.0)
    live.present(SOURCE, 1.0)
    before = live.places_m[:500].mean(axis=0)
    for _ in range(100):
        live.step(0.05)
    assert np.linalg.norm(live.places_m[:500].mean(axis=0) - before) > 0.05
