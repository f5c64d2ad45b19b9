"""Steady air is the textbook's; puffs spread as Taylor says whatever the step, thin out, come and go, and repeat themselves."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.special import erfc

from hardware.air.filament import Filament
from oio.core.errors import BadInput

SOURCE = np.array([0.3, 0.05, 0.2])


def opened(air, truth=1, disturbance=2):
    return air.open(np.random.default_rng(truth), np.random.default_rng(disturbance))


def test_steady_still_air_is_q_over_4_pi_k_r(built):
    air = built("air", "air=steady")
    live = opened(air)
    live.present(SOURCE, 0.1)
    for r in (0.05, 0.1, 0.3):
        for side in np.concatenate([np.eye(3), -np.eye(3)]):
            assert live.ppm(SOURCE + r * side) == pytest.approx(0.1 / (4 * math.pi * air.diffusivity_m2_s * r))
    assert math.isfinite(live.ppm(SOURCE))


def test_steady_wind_carries_down_wind(built):
    """On the axis nothing is lost; against the wind exp(-U r / K); beside it exp(-U r / 2 K)."""
    air = replace(built("air", "air=steady"), wind_m_s=(0.02, 0.0, 0.0))
    live, k = opened(air), air.diffusivity_m2_s
    live.present(SOURCE, 0.1)
    still = 0.1 / (4 * math.pi * k * 0.1)
    assert live.ppm(SOURCE + np.array([0.1, 0.0, 0.0])) == pytest.approx(still)
    assert live.ppm(SOURCE - np.array([0.1, 0.0, 0.0])) == pytest.approx(still * math.exp(-0.02 * 0.1 / k))
    assert live.ppm(SOURCE + np.array([0.0, 0.1, 0.0])) == pytest.approx(still * math.exp(-0.02 * 0.1 / (2 * k)))


def test_steady_air_fulfils_its_equation(built):
    """U . grad C = K laplace C, away from the source."""
    air = replace(built("air", "air=steady"), wind_m_s=(0.02, -0.01, 0.005))
    live, h, p = opened(air), 1e-3, SOURCE + np.array([0.08, 0.05, -0.04])
    live.present(SOURCE, 0.1)
    c = live.ppm(p)
    up, down = (np.array([live.ppm(p + sign * h * e) for e in np.eye(3)]) for sign in (1, -1))
    advected = np.array(air.wind_m_s) @ (up - down) / (2 * h)
    diffused = air.diffusivity_m2_s * np.sum(up + down - 2 * c) / h**2
    assert advected == pytest.approx(diffused, rel=1e-2)


def room(**changes):
    """Many puffs, no wind, no meander; everything that is not asked about is off."""
    plain = {
        "name": "room", "wind_m_s": 0.0, "turbulence_m_s": 0.05, "eddy_s": 0.4, "meander_m_s": 0.0, "meander_s": 5.0, "puffs_per_s": 500.0,
        "puff_m": 0.01, "growth_m2_s": 2.0e-4, "age_s": 60.0, "range_m": 10.0, "spin_up_s": 0.0,
    }  # fmt: skip
    return Filament(**{**plain, **changes})


def burst(air, after_s, dt_s, seed=0):
    """Places (n, 3) of the puffs of one 20 ms burst, `after_s` later, from several disturbances."""
    places = []
    for k in range(20):
        live = opened(air, disturbance=1000 * seed + k)
        live.present(np.zeros(3), 1.0)
        for _ in range(20):
            live.step(0.02)
        live._emitters = ()  # the tap is closed, the air goes on
        for _ in range(round(after_s / dt_s)):
            live.step(dt_s)
        places.append(live.places_m)
    return np.concatenate(places)


def test_puffs_spread_as_taylor_says_whatever_the_step():
    """sigma^2 = 2 u^2 T (t - T (1 - exp(-t / T))) (Taylor 1921), here for a burst of 0.4 s."""
    air, u, t_l = room(), 0.05, 0.4
    ages = 2.0 + np.arange(0.02, 0.41, 0.02) - 0.02
    expected = math.sqrt(np.mean(2 * u**2 * t_l * (ages - t_l * (1 - np.exp(-ages / t_l)))))
    spreads = [float(np.sqrt(np.mean(burst(air, 2.0, dt_s, seed) ** 2))) for seed, dt_s in enumerate((0.01, 0.05, 0.2))]
    for spread in spreads:
        assert spread == pytest.approx(expected, rel=0.05)
    assert max(spreads) < 1.05 * min(spreads)


def test_wind_carries_the_puffs():
    live = opened(room(wind_m_s=0.1), truth=5)
    live.present(np.zeros(3), 1.0)
    for _ in range(20):
        live.step(0.02)
    live._emitters = ()
    for _ in range(100):
        live.step(0.02)
    assert np.hypot(*live.wind_m_s[:2]) == pytest.approx(0.1) and live.wind_m_s[2] == 0.0
    np.testing.assert_allclose(live.places_m.mean(axis=0), live.wind_m_s * 2.2, atol=0.02)


def test_gas_is_neither_made_nor_lost():
    """A sum over a grid is what the tap let out: 1 ml/s for a second is 1 ppm m^3."""
    live = opened(room(puffs_per_s=40.0, puff_m=0.03))
    live.present(np.zeros(3), 1.0)
    for _ in range(50):
        live.step(0.02)
    axis = np.arange(-0.5, 0.5001, 0.04)
    total = sum(live.ppm(np.array([x, y, z])) for x in axis for y in axis for z in axis) * 0.04**3
    assert total == pytest.approx(1.0, rel=0.05)


@pytest.fixture(scope="module")
def felt(built):
    """Concentrations of a still and a ventilated room (places, times): along the mean wind at 5, 10, 20, 40 cm, and beside it."""
    out = {}
    for name in ("still", "ventilated"):
        live = opened(built("air", f"air={name}"))
        live.present(SOURCE, 0.1)
        wind = live.wind_m_s if name == "ventilated" else np.array([1.0, 0.0, 0.0])
        along = wind / np.linalg.norm(wind)
        beside = np.array([-along[1], along[0], 0.0])
        places = [*(SOURCE + r * along for r in (0.05, 0.1, 0.2, 0.4)), SOURCE + 0.1 * along + 0.1 * beside]
        rows = []
        for _ in range(400):
            for _ in range(5):
                live.step(0.04)
            rows.append([live.ppm(p) for p in places])
        out[name] = np.array(rows).T
    return out


@pytest.mark.parametrize("name", ["still", "ventilated"])
def test_the_mean_falls_off_with_distance(felt, name):
    means = felt[name][:4].mean(axis=1)
    assert np.all(np.diff(means) < 0) and means[3] < 0.4 * means[0]


def test_still_rooms_are_those_of_eddy_diffusion(built, felt):
    """K = u^2 T + D, and a Gaussian is seldom far from 1 / r: q / (4 pi K r) erfc(r / 2 sqrt(K t)) after t, within a third."""
    air = built("air", "air=still")
    k = air.turbulence_m_s**2 * air.eddy_s + air.growth_m2_s
    for mean, r in zip(felt["still"][1:3].mean(axis=1), (0.1, 0.2), strict=True):
        expected = 0.1 / (4 * math.pi * k * r) * erfc(r / (2 * math.sqrt(k * air.age_s)))
        assert mean == pytest.approx(expected, rel=0.4)


def test_a_ventilated_plume_is_intermittent(felt):
    """Beside its axis gas comes in whiffs, with quiet in between; in the still room it never is quiet near the source."""
    beside, near = felt["ventilated"][4], felt["still"][0]
    assert np.std(beside) > np.mean(beside)
    assert np.mean(beside < 0.1 * np.mean(beside)) > 0.3 > np.mean(near < 0.1 * np.mean(near))


@pytest.mark.parametrize("name", ["still", "ventilated"])
def test_the_seed_of_the_disturbance_changes_the_whiffs_not_the_wind(built, name):
    def felt_with(disturbance):
        live = opened(replace(built("air", f"air={name}"), spin_up_s=5.0), disturbance=disturbance)
        live.present(SOURCE, 0.1)
        live.step(0.04)
        return live.wind_m_s, live.ppm(SOURCE + np.array([0.03, 0.0, 0.0]))

    (wind, a), (same, again), (other_wind, other) = felt_with(2), felt_with(2), felt_with(3)
    assert a == again != other
    np.testing.assert_array_equal(wind, same)
    np.testing.assert_array_equal(wind, other_wind)


def test_the_density_is_the_sum_of_gaussians():
    """The loop's exponential series and float32 against double precision."""
    air = room(puffs_per_s=40.0, spin_up_s=30.0)
    live = opened(air)
    live.present(SOURCE, 0.1)
    variance = air.puff_m**2 + 2 * air.growth_m2_s * live._puffs[6, : live._count].astype(float)
    for p in SOURCE + np.array([[0.0, 0.0, 0.0], [0.05, 0.0, 0.0], [0.1, 0.2, -0.1], [0.0, 0.7, 0.0]]):
        d2 = np.sum((live.places_m - p) ** 2, axis=1)
        gaussians = np.exp(-0.5 * d2 / variance) / (2 * math.pi * variance) ** 1.5
        assert live.ppm(p) == pytest.approx(0.1 / 40.0 * np.sum(gaussians), rel=1e-4)
    live.present(None, 0.0)
    assert live.ppm(SOURCE) == 0.0


def test_a_plume_that_has_stood_is_spread_as_taylor_says():
    """V(t) of own velocity and shared meander add up; puffs of two ages have the meander in common: (V(s) + V(t) - V(t - s)) / 2."""
    air = room(spin_up_s=4.0, puffs_per_s=10.0, meander_m_s=0.05, meander_s=1.0, wind_m_s=0.05)

    def taylor(u, t_l, t):
        return 2 * u**2 * t_l * (t - t_l * (1 - math.exp(-t / t_l)))

    drifted = []
    for k in range(2000):
        live = opened(air, disturbance=k)
        live.present(np.zeros(3), 1.0)
        assert live._count == 40
        drifted.append(live.places_m[[10, 39]] - np.array([[1.0], [3.9]]) * live.wind_m_s)
    young, old = np.array(drifted).transpose(1, 0, 2)
    shared = {t: taylor(0.05, 1.0, t) for t in (1.0, 2.9, 3.9)}
    assert np.mean(young**2) == pytest.approx(shared[1.0] + taylor(0.05, 0.4, 1.0), rel=0.08)
    assert np.mean(old**2) == pytest.approx(shared[3.9] + taylor(0.05, 0.4, 3.9), rel=0.08)
    assert np.mean(young * old) == pytest.approx((shared[1.0] + shared[3.9] - shared[2.9]) / 2, rel=0.15)


def test_old_and_far_puffs_are_forgotten():
    live = opened(room(age_s=2.0))
    live.present(np.zeros(3), 1.0)
    for _ in range(300):
        live.step(0.02)
    assert live._count == pytest.approx(1000, abs=15)  # 500 per second, 2 s old at most
    near = opened(room(range_m=0.1, wind_m_s=0.1))
    near.present(np.zeros(3), 1.0)
    for _ in range(300):
        near.step(0.02)
    assert np.max(np.linalg.norm(near.places_m, axis=1)) < 0.12


def test_senseless_rooms_are_refused(built):
    for changes in ({"eddy_s": 0.0}, {"puffs_per_s": 0.5}, {"wind_m_s": -1.0}):
        with pytest.raises(BadInput, match=next(iter(changes))):
            room(**changes)
    with pytest.raises(BadInput, match="diffusivity_m2_s"):
        replace(built("air", "air=steady"), diffusivity_m2_s=0.0)
