"""The slope from a pair of elements: found, weighed and followed; and what a pair tells the D-optimal search."""

from dataclasses import replace

import numpy as np
import pytest

from oio.core.errors import BadInput
from oio.core.records import Belief
from oio.search.d_optimal import expected_information
from oio.search.sniff_history import sniff_history
from oio.search.stereo import UNIT_M, Stereo
from oio.search.view import Move, View

SEARCH = Stereo(
    fit_sniffs=10, step=0.08, min_step=0.02, step_factor=0.7, slope_sd=1.0, curvature=0.5, significance=1.0, orientations=24
)  # fmt: skip
SLOPE = np.array([3.0, -8.0, 4.0])  # of ln c, 1/m


def seen(built, lab, spacing_m=0.06, elements=2):
    arm = built("arm", "dof=5", f"arm.element_spacing_m={spacing_m}")
    return View(arm, replace(lab(3, elements).model, arm=arm, sigma_ppm=1e-4), None, (), (), dwell_s=1.0, standoff_m=0.04)


def sniffed(view, poses, slope=SLOPE):
    """The view after moves to poses, in a field whose ln rises along a slope, with a sensor that has settled."""
    moves = []
    for q in poses:
        ends, _ = view.arm.element_jacobians(q[None], 2)
        signals = 5.0 * np.exp((np.resize(ends[:, 0], (2, 3)) - view.arm.nose(view.arm.home)) @ slope)
        moves.append(Move(q, 0.5, float(np.mean(signals)), q, False, tuple(signals)))
    return replace(view, moves=tuple(moves), model=replace(view.model, rise_s=1e-3, fall_s=1e-3))


def slope_of(view, n=1):
    history = sniff_history(view)
    mean, cov = replace(SEARCH, curvature=0.0).slope(view, history, n - 1)
    return mean / UNIT_M, cov / UNIT_M**2


def test_one_sniff_of_a_pair_tells_the_slope_along_the_board(built, lab):
    view = sniffed(seen(built, lab), [lab(5).arm.home])
    ends, _ = view.arm.element_jacobians(view.arm.home[None], 2)
    along = (ends[0, 0] - ends[1, 0]) / 0.06
    mean, cov = slope_of(view)
    sd = np.sqrt(along @ cov @ along)
    across = np.linalg.svd(along[None])[2][1:]
    assert abs(along @ mean - along @ SLOPE) < 3 * sd < 30.0
    np.testing.assert_allclose(across @ mean, 0.0, atol=1e-9)  # and nothing across it: the prior is left
    np.testing.assert_allclose(np.diag(across @ cov @ across.T), (SEARCH.slope_sd / UNIT_M) ** 2)


def test_elements_at_one_place_tell_nothing_in_one_sniff(built, lab):
    mean, _ = slope_of(sniffed(seen(built, lab, 0.0), [lab(5).arm.home]))
    np.testing.assert_array_equal(mean, 0.0)


def test_sniffs_with_the_board_turned_tell_the_whole_slope(built, lab):
    made = lab(5, seed=3)
    calm = seen(built, lab)
    calm = replace(calm, model=replace(calm.model, fluctuation=replace(calm.model.fluctuation, gamma=1e-4)))
    view = sniffed(calm, [made.arm.random_pose(made.rng) for _ in range(8)])
    mean, cov = slope_of(view, 8)
    assert np.linalg.norm(mean - SLOPE) < 0.05 * np.linalg.norm(SLOPE) and np.all(np.diag(cov) < 1.0)


def test_a_significant_slope_is_followed_and_any_other_looked_into(rng=None):
    rng, slope = np.random.default_rng(0), np.array([0.3, 0.4, 0.0])
    np.testing.assert_allclose(SEARCH.direction(slope, 1e-2 * np.eye(3), rng), [0.6, 0.8, 0.0])
    cov = np.diag([1.0, 1.0, 4.0])
    np.testing.assert_allclose(np.abs(SEARCH.direction(slope, cov, rng)), [0.0, 0.0, 1.0], atol=1e-6)


def test_the_board_is_turned_across_where_the_slope_is_known_least(built, lab):
    view = sniffed(seen(built, lab), [lab(5).arm.home])
    direction, cov = np.array([0.0, 0.0, 1.0]), np.diag([1.0, 0.01, 1.0])
    goal = view.arm.home + np.array([0.1, 0.05, 0.0, 0.0, 0.0])
    turned = SEARCH._turned(view, goal, direction, cov, np.random.default_rng(1))
    told = []
    for q in (goal, turned):
        ends, _ = view.arm.element_jacobians(q[None], 2)
        told.append(abs((ends[0, 0] - ends[1, 0]) @ [1.0, 0.0, 0.0]))
    assert told[1] > told[0] + 0.01 and np.linalg.norm(view.arm.nose(turned) - view.arm.nose(goal)) < 2e-3


def test_a_first_step_below_the_shortest_is_refused():
    with pytest.raises(BadInput, match="at least min_step"):
        replace(SEARCH, step=0.01)


def test_the_information_of_a_pair_is_that_of_a_kalman_update(built, lab):
    """ln det of the source's precision after both measurements, less before, with their noise's correlation exp(-d / r)."""
    view = seen(built, lab)
    view = replace(view, model=replace(view.model, sigma_ppm=0.05))
    model, rng = view.model, np.random.default_rng(4)
    at, mean = model.at, np.zeros(model.size)
    mean[at["s"]], mean[at["l"]], mean[at["n"]] = view.arm.nose(view.arm.home) + np.array([0.05, 0.1, 0.02]), 3.0, 1.0
    root = rng.standard_normal((model.size, model.size))
    cov = 1e-4 * (root @ root.T / model.size + np.eye(model.size))
    view = replace(view, belief=Belief(0, mean, cov))
    q = view.arm.home + 0.1
    gain = float(expected_information(view, q[None])[0])

    def logs(x):
        ends, _ = view.arm.element_jacobians((q - x[at["o"]])[None], 2)
        r = np.linalg.norm(ends[:, 0] - x[at["s"]], axis=1)
        return x[at["l"]][0] - x[at["n"]][0] * np.log(np.maximum(r, 0.01) / 0.1), r

    keys = np.r_[at["o"], at["s"], at["l"]]
    rows = np.zeros((2, model.size))
    for j in keys:
        step = 1e-6 * np.eye(model.size)[j]
        rows[:, j] = (logs(mean + step)[0] - logs(mean - step)[0]) / 2e-6
    kept = np.zeros(model.size, dtype=bool)
    kept[keys] = True
    cov_kept = np.where(np.outer(kept, kept), cov, 0.0) + np.diag(np.where(kept, 0.0, 1e-18))
    only = float(expected_information(replace(view, belief=Belief(0, mean, cov_kept)), q[None])[0])
    ln_c, r = logs(mean)
    fl = model.fluctuation
    eddies = np.maximum(view.dwell_s * (0.1 / fl.t_s) / r, 1.0)
    height2 = 1.0 + ((model.law.nose_jitter_m / r) ** 2 + (model.law.model_discrepancy * np.log(r / 0.1)) ** 2) / fl.gamma**2
    swing = fl.gamma * np.sqrt(height2 / eddies)
    noise = np.outer(swing, swing) * np.array([[1.0, np.exp(-0.12 / np.sum(r))], [np.exp(-0.12 / np.sum(r)), 1.0]])
    noise += np.diag((0.05 / np.exp(ln_c)) ** 2)
    after = cov_kept - cov_kept @ rows.T @ np.linalg.solve(rows @ cov_kept @ rows.T + noise, rows @ cov_kept)
    expected = np.linalg.slogdet(cov_kept[at["s"], at["s"]])[1] - np.linalg.slogdet(after[at["s"], at["s"]])[1]
    assert only == pytest.approx(expected, rel=0.02) and gain > 0.0
