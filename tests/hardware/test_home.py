"""Homing: ends of joints to zeros, what is refused, and that its uncertainty reaches the filter."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hardware.turned import Turned, joined
from oio.errors import BadInput, OioError
from oio.homing import Homing
from oio.knowledge import prior
from oio.problem import Layout

TURN = 4096
DEGREES = 360.0 / TURN


@pytest.fixture(scope="module")
def arm(built):
    return built("arm")


def turned_like(arm, zeros, signs, misfit_deg=0.0):
    """Joints that were turned between their ends, each end `misfit_deg` / 2 short of the MJCF's."""
    rounds = []
    for i, (zero, sign) in enumerate(zip(zeros, signs, strict=True)):
        turned = Turned(arm.all_names[i], TURN)
        low, high = np.degrees(arm.low_rad[i]) + misfit_deg / 2, np.degrees(arm.high_rad[i]) - misfit_deg / 2
        for degrees in np.linspace(low, high, 40):
            turned.add(round(zero + sign * degrees / DEGREES))
        rounds.append(turned)
    return rounds


@given(shift=st.lists(st.integers(-200, 200), min_size=5, max_size=5), signs=st.lists(st.sampled_from([-1, 1]), min_size=5, max_size=5))
def test_the_zero_comes_back_whatever_servo_it_is_and_however_it_is_mounted(arm, shift, signs):
    zeros = [2048 + s for s in shift]
    homing = joined([turned_like(arm, zeros, signs)] * 2, arm, tuple(signs), TURN)
    assert np.max(np.abs(np.array(homing.zero_counts) - zeros)) <= 1 and homing.sign == tuple(signs)
    play = arm.backlash_deg / 2 / math.sqrt(3)
    assert np.array(homing.u_deg) == pytest.approx(play, rel=0.1)


def test_an_end_that_was_not_reached_costs_certainty_and_then_is_refused(arm):
    zeros, signs = [2048] * 5, (1,) * 5
    sure = joined([turned_like(arm, zeros, signs)], arm, signs, TURN)
    doubtful = joined([turned_like(arm, zeros, signs, 10.0)], arm, signs, TURN)
    assert min(doubtful.u_deg) == pytest.approx(math.hypot(5.0 / math.sqrt(3), sure.u_deg[0]), rel=0.02)
    with pytest.raises(OioError, match="shoulder_azimuth was turned by 200 degrees, but its ends in the MJCF are 220"):
        joined([turned_like(arm, zeros, signs, 20.0)], arm, signs, TURN)


def test_a_wrap_inside_the_range_is_refused_with_what_to_do():
    turned = Turned("elbow_flex", TURN)
    for counts in range(3000, 4096, 50):
        turned.add(counts)
    with pytest.raises(OioError, match=r"elbow_flex jumped from 4050 to 4: .*wraps.*2048.*home again"):
        turned.add(4)


@given(q=st.lists(st.floats(-1.5, 1.5), min_size=5, max_size=5), signs=st.lists(st.sampled_from([-1, 1]), min_size=5, max_size=5))
def test_angles_and_counts_undo_each_other_to_half_a_count(q, signs):
    homing = Homing((2048, 1900, 2100, 2000, 2222), tuple(signs), (0.0,) * 5)
    back = homing.angles(homing.counts(np.array(q), TURN), TURN)
    assert np.max(np.abs(back - q)) <= math.pi / TURN * (1 + 1e-9)


def test_the_uncertainty_of_homing_reaches_the_covariance_of_the_filter(built, tmp_path):
    file = tmp_path / "homing.json"
    Homing((2048,) * 5, (1,) * 5, (0.3, 0.4, 0.5, 0.6, 2.0)).write(file)
    plain, homed = built("arm"), built("arm", f"arm.homing={file}")
    law, nominal = built("range"), built("nominal")
    offsets = np.zeros(nominal.elements), np.ones(nominal.elements)
    (_, without), (_, with_it) = (prior(a, law, nominal, *offsets) for a in (plain, homed))
    n = Layout(5, nominal.elements).offset
    more = np.degrees(np.sqrt(np.diag(with_it)[n])) ** 2 - np.degrees(np.sqrt(np.diag(without)[n])) ** 2
    assert np.sqrt(more) == pytest.approx([0.3, 0.4, 0.5, 0.6, 2.0], rel=1e-3)


@pytest.mark.parametrize(
    "text",
    ["", "[]", "{}", '{"zero_counts": [1], "sign": [1], "u_deg": [1]}', '{"zero_counts": 1, "sign": 1, "u_deg": 1}', "__import__('os')"],
)
def test_a_file_that_is_no_homing_is_refused(built, tmp_path, text):
    file = tmp_path / "homing.json"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(BadInput, match=r"arm\.homing=.*python -m hardware\.home"):
        replace(built("arm"), homing=str(file))


@pytest.mark.parametrize("broken", [{"sign": [1, 1, 1, 1, 0]}, {"u_deg": [0, 0, 0, 0, -1]}, {"zero_counts": [1, 2, 3, 4, "5"]}])
def test_figures_that_make_no_sense_are_refused(built, tmp_path, broken):
    file = tmp_path / "homing.json"
    sound = {"zero_counts": [2048] * 5, "sign": [1] * 5, "u_deg": [0.3] * 5}
    file.write_text(json.dumps(sound | broken), encoding="utf-8")
    with pytest.raises(BadInput, match=r"arm\.homing="):
        replace(built("arm"), homing=str(file))
