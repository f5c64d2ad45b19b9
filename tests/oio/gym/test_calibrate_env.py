"""`OIO/Calibrate-v0`: every measurement at the beacon is an action, and what it tells is its reward."""

import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env

from oio.core.errors import BadInput


def as_bytes(told):
    return b"".join(told[name].tobytes() for name in sorted(told))


def episode(env, seed):
    env.action_space.seed(seed)
    told, info = env.reset(seed=seed)
    kept = [(told, 0.0, False, False)]
    while not (kept[-1][2] or kept[-1][3]):
        told, gain, terminated, truncated, info = env.step(env.action_space.sample())
        kept.append((told, gain, terminated, truncated))
    return kept, info


def test_gymnasium_finds_nothing_to_complain_of(calibrating):
    check_env(calibrating(max_moves=3).unwrapped, skip_render_check=True)


def test_an_episode_ends_when_the_time_of_a_calibration_is_spent(calibrating):
    env = calibrating(overrides={"stage.map_beliefs.budget_s": 15})
    kept, info = episode(env, 1)
    assert all(env.observation_space.contains(told) and np.isfinite(gain) for told, gain, _, _ in kept)
    assert kept[-1][2] and not kept[-1][3] and info["seconds"] >= 15
    assert sum(gain for _, gain, _, _ in kept) == pytest.approx(info["known_nats"])
    assert info["known_nats"] > 5.0


def test_same_seed_and_actions_give_the_same_bytes(calibrating):
    first, again, other = (episode(calibrating(max_moves=4), seed)[0] for seed in (5, 5, 6))
    assert [(as_bytes(told), gain) for told, gain, *_ in first] == [(as_bytes(told), gain) for told, gain, *_ in again]
    assert as_bytes(first[-1][0]) != as_bytes(other[-1][0])


def test_the_nose_keeps_off_the_beacon(calibrating):
    env = calibrating(dof=5, max_moves=6)
    env.reset(seed=0)
    stage, here = env.unwrapped.stage, env.unwrapped.goal
    for action in np.random.default_rng(0).uniform(-0.2, 0.2, (6, 3)):
        env.step(action.astype(np.float32))
        there = env.unwrapped.goal
        moved = np.linalg.norm(there - here) > 1e-9
        assert not moved or stage.arm.clearance_m(here, there, np.array(stage.beacon.position)) >= stage.beacon.approach_m
        here = there


def test_there_is_no_step_before_an_episode_nor_after_it(calibrating):
    env = calibrating(max_moves=1).unwrapped
    with pytest.raises(ResetNeeded):
        env.step(np.zeros(3))
    env.reset(seed=0)
    assert env.step(np.zeros(3))[3]
    with pytest.raises(ResetNeeded):
        env.step(np.zeros(3))


def test_what_is_wrong_is_refused(calibrating):
    with pytest.raises(BadInput, match="max_moves is 0"):
        calibrating(max_moves=0)
    with pytest.raises(BadInput, match="max_moves is 'many'"):
        calibrating(max_moves="many")
    with pytest.raises(BadInput, match="second_cost is nan"):
        calibrating(second_cost=float("nan"))
    with pytest.raises(BadInput, match="bench_seeds is empty"):
        calibrating(bench_seeds=())
