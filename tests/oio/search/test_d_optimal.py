"""The bandit of the paper and the D-optimal sniff: what they choose, and that they keep their promises."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from oio.core.records import nanoseconds
from oio.inference.initial_belief import initial_belief
from oio.search.bandit import Bandit, Values
from oio.search.d_optimal import expected_information, source_hypotheses
from oio.search.exploration import explore
from oio.search.view import Move, View
from oio.testing import check_strategy

BANDIT = Bandit(step_rad=0.12, discount=0.9, exploration_bonus=0.3)


def empty(made):
    return View(made.arm, made.model, None, (), (), dwell_s=1.0, standoff_m=0.04)


@pytest.fixture(scope="module")
def informed(lab, built):
    """A search after six moves, with a belief map."""
    made = lab(3, 1, seed=31)
    problem = made.problem(made.theta(), poses=6)
    hypotheses = built("belief_map").locate(problem.sniffs, made.known)
    moves = tuple(Move(problem.sniffs.q[i], 0.0, 1.0) for i in np.searchsorted(problem.sniffs.t_s, 2.0 * np.arange(1, 7)) - 1)
    belief = initial_belief(made.model, hypotheses[0], nanoseconds(problem.sniffs.t_s[-1]), 6)
    return View(made.arm, made.model, belief, hypotheses, moves, dwell_s=1.0, standoff_m=0.04)


@pytest.mark.parametrize("search", ["bandit", "d_optimal"])
@pytest.mark.parametrize("dof", [1, 2, 3, 5])
def test_strategies_keep_their_promises_from_the_start(built, lab, search, dof):
    check_strategy(built("search", f"search={search}"), empty(lab(dof)))


@pytest.mark.parametrize("search", ["bandit", "d_optimal"])
def test_strategies_keep_their_promises_later(built, informed, search):
    check_strategy(built("search", f"search={search}"), informed)


@dataclass(frozen=True)
class Reckless:
    """Goes where it likes."""

    def propose(self, view, rng):
        return view.arm.home + 3.0


def test_a_reckless_strategy_is_found(lab):
    with pytest.raises(AssertionError, match="only what the arm may do"):
        check_strategy(Reckless(), empty(lab(3)))


def test_one_joint_has_three_arms_left_right_stay():
    q = np.array([0.3])
    assert len(Values.none(1).reward) == 3 and len(Values.none(5).reward) == 11
    np.testing.assert_allclose([BANDIT.goal(q, i) for i in range(3)], [[0.3], [0.18], [0.42]])


def test_every_other_joint_adds_two_arms():
    goals = np.array([BANDIT.goal(np.zeros(3), i) for i in range(7)])
    np.testing.assert_allclose(goals, 0.12 * np.array([[0, 0, 0], [-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0], [0, 0, -1], [0, 0, 1]]))


def played(pays, moves, seed=0, bandit=BANDIT, values=None):
    """Which arms are chosen in `moves` moves when arm i pays `pays[i]`, and the values at the end."""
    rng, values, chosen = np.random.default_rng(seed), values or Values.none(1), []
    for _ in range(moves):
        i = bandit.choose(values, np.ones(3, dtype=bool), rng)
        values = bandit.rewarded(values, i, pays[i])
        chosen.append(i)
    return np.array(chosen), values


@pytest.mark.parametrize("best", [0, 1, 2])
def test_it_prefers_the_arm_that_pays(best):
    chosen, _ = played(np.eye(3)[best], 60)
    assert set(chosen[:5]) == {0, 1, 2}  # all are tried first
    assert np.mean(chosen[10:] == best) > 0.6


def test_it_forgets_an_arm_that_pays_no_more():
    _, values = played(np.eye(3)[1], 40)
    after, _ = played(np.eye(3)[2], 60, values=values)
    assert np.mean(after[20:] == 2) > 0.5


def test_values_are_discounted():
    values = BANDIT.rewarded(BANDIT.rewarded(Values.none(1), 1, 1.0), 2, 0.5)
    np.testing.assert_allclose(values.reward, [0.0, 0.9, 0.5])
    np.testing.assert_allclose(values.count, [0.0, 0.9, 1.0])
    kept = replace(BANDIT, discount=1.0)
    np.testing.assert_allclose(kept.rewarded(values, 2, 0.5).reward, [0.0, 0.9, 1.0])


def test_a_forbidden_arm_is_never_chosen():
    values = Values(np.array([0.0, 9.0, 0.0]), np.ones(3))
    allowed = np.array([True, False, True])
    assert all(BANDIT.choose(values, allowed, np.random.default_rng(seed)) != 1 for seed in range(20))


def test_arms_out_of_the_box_are_forbidden(lab):
    arm = lab(1).arm
    edge = arm.home
    while arm.is_allowed(edge + 0.12):
        edge = edge + 0.12
    np.testing.assert_array_equal(BANDIT.allowed(arm, edge, 1), [True, True, False])


def test_the_bandit_rebuilds_its_values_from_the_moves(lab):
    """Right paid three times, left and stay did not: without curiosity it goes right again."""
    made, greedy = lab(1), replace(BANDIT, exploration_bonus=0.0)
    q, moves = made.arm.home, []
    for step, bouts in ((0.0, 0.0), (-0.12, 0.0), (0.12, 1.0), (0.12, 1.0), (0.12, 1.0)):
        q = q + step
        moves.append(Move(q, bouts, 1.0))
    view = replace(empty(made), moves=tuple(moves))
    np.testing.assert_allclose(greedy.propose(view, np.random.default_rng(0)), q + 0.12)


def test_d_optimal_keeps_off_the_believed_source(built, informed):
    strategy, here = built("search", "search=d_optimal"), informed.moves[-1].q
    source = source_hypotheses(informed)[0]
    for seed in range(10):
        goal = strategy.propose(informed, np.random.default_rng(seed))
        assert informed.arm.is_allowed(goal)
        assert informed.arm.clearance_m(here, goal, source) >= informed.standoff_m - 1e-9
    wide = replace(informed, standoff_m=0.12)
    assert informed.arm.clearance_m(here, strategy.propose(wide, np.random.default_rng(0)), source) >= 0.12 - 1e-9


def test_d_optimal_sniffs_where_it_tells_more_than_anywhere(built, informed):
    strategy, alone = built("search", "search=d_optimal"), replace(informed, hypotheses=informed.hypotheses[:1])
    chosen = np.array([strategy.propose(alone, np.random.default_rng(seed)) for seed in range(8)])
    rng = np.random.default_rng(0)
    random_candidates = np.array([alone.arm.random_pose(rng) for _ in range(40)])
    assert np.mean(expected_information(alone, chosen)) > 2.0 * np.mean(expected_information(alone, random_candidates))


def test_information_is_never_negative_and_grows_with_the_dwell(informed):
    rng, alone = np.random.default_rng(1), replace(informed, hypotheses=informed.hypotheses[:1])
    poses = np.array([informed.arm.random_pose(rng) for _ in range(30)])
    short, long = expected_information(alone, poses), expected_information(replace(alone, dwell_s=60.0), poses)
    assert np.all(short >= 0) and np.all(long >= short - 1e-12) and np.mean(long) > np.mean(short)


def test_without_a_belief_d_optimal_scouts(built, informed):
    strategy, lost = built("search", "search=d_optimal"), replace(informed, belief=None, hypotheses=())
    for seed in range(3):
        goals = (strategy.propose(lost, np.random.default_rng(seed)), explore(lost, np.random.default_rng(seed)))
        np.testing.assert_array_equal(*goals)
