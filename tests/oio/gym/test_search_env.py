"""`OIO/Search-v0` is an environment of gymnasium's kind, the same search as that of a run, and tells its agent nothing of the truth."""

from dataclasses import replace

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AsyncVectorEnv, SyncVectorEnv

from hardware.simulation.plant import Plant
from oio.bench.trial import experiment
from oio.core.errors import BadInput
from oio.log import MemoryLog
from oio.results.calibration import Navigation
from oio.runtime.runner import run_stages

pytestmark = pytest.mark.long


def episode(env, seed, moves=100):
    """Observations, rewards and ends of an episode with random actions, and its last info."""
    env.action_space.seed(seed)
    told, info = env.reset(seed=seed)
    kept = [(told, 0.0, False, False)]
    while len(kept) <= moves and not (kept[-1][2] or kept[-1][3]):
        told, reward, terminated, truncated, info = env.step(env.action_space.sample())
        kept.append((told, reward, terminated, truncated))
    return kept, info


def as_bytes(told):
    return b"".join(told[name].tobytes() for name in sorted(told))


def test_gymnasium_finds_nothing_to_complain_of(searching):
    check_env(searching().unwrapped, skip_render_check=True)


@pytest.mark.parametrize("frame", ["box", "source"])
@pytest.mark.parametrize("reward", ["information", "log_score"])
def test_random_actions_stay_in_the_spaces_and_end(searching, frame, reward):
    env = searching(moves=12, frame=frame, reward=reward)
    kept, info = episode(env, 1)
    for told, gain, _, _ in kept:
        assert env.observation_space.contains(told) and np.isfinite(gain)
    assert kept[-1][2] or kept[-1][3]
    assert info["moves"] <= 12 and (info["declared"] == kept[-1][2])
    assert info["truth"]["error_m"] < 1.0


def test_same_seed_and_actions_give_the_same_bytes_and_another_seed_others(searching):
    first, again, other = (episode(searching(), seed)[0] for seed in (5, 5, 6))
    assert [(as_bytes(told), *rest) for told, *rest in first] == [(as_bytes(told), *rest) for told, *rest in again]
    assert as_bytes(first[-1][0]) != as_bytes(other[-1][0])


def test_an_episode_of_a_world_seed_does_not_depend_on_those_before(searching):
    env, fresh = searching(), searching()
    episode(env, 1, moves=2)
    (after, info), (alone, also) = (each.reset(seed=2, options={"world_seed": 9}) for each in (env, fresh))
    action = np.array([0.5, -0.5, 0.0], dtype=np.float32)
    assert as_bytes(after) == as_bytes(alone) and info == also
    assert as_bytes(env.step(action)[0]) == as_bytes(fresh.step(action)[0])


def test_a_run_of_its_own_bench_is_that_of_the_command_line(searching, tmp_path):
    """The goals of a run, proposed at the same times, make the same moves and maps: there is no second simulator."""
    env = searching(moves=7, bench_seeds=None).unwrapped
    env.reset(options={"world_seed": 4})
    with env.episode.attended():
        while not env.loop.over:
            env.loop.move(env.loop.proposed())
        env.loop.finish()
    built = experiment(env._words, 4)
    stages = {name: stage for name, stage in built.stages.items() if name != "evaluate"}
    with built.backend.open() as world:
        run = run_stages(stages, world, built.arm, MemoryLog(), tmp_path, 4, built.sensor.highest_raw)[Navigation]
    assert run.move_ends_ns == tuple(env.loop.ends_ns) and run.maps_ns == tuple(t_ns for t_ns, _ in env.loop.maps)
    assert run.source_m == tuple(env.loop.odometry.source()[0])


def test_the_truth_reaches_rewards_alone(searching, monkeypatch):
    """Two worlds with the same readings that say other things of the truth: same observations, other rewards."""
    honest, _ = episode(searching(reward="log_score"), 7)
    truth = Plant.truth
    monkeypatch.setattr(Plant, "truth", lambda self: replace(truth(self), source_m=np.full(3, 0.1), nose_m=np.zeros(3), ppm=0.0))
    told, info = episode(searching(reward="log_score"), 7)
    assert [as_bytes(one) for one, *_ in honest] == [as_bytes(one) for one, *_ in told]
    assert [gain for _, gain, _, _ in honest] != [gain for _, gain, _, _ in told]
    assert list(info["truth"]["source_m"]) == [0.1, 0.1, 0.1]


def test_reward_information_looks_at_no_truth(searching, monkeypatch):
    honest, _ = episode(searching(), 7)
    truth = Plant.truth
    monkeypatch.setattr(Plant, "truth", lambda self: replace(truth(self), source_m=np.full(3, 0.1)))
    assert [gain for _, gain, _, _ in honest] == [gain for _, gain, _, _ in episode(searching(), 7)[0]]


def test_the_rewards_of_an_episode_add_up_to_what_it_gained(searching):
    env = searching(reward="information", second_cost=0.0, declared=0.0)
    kept, info = episode(env, 3)
    arm = env.unwrapped.view.arm
    anywhere = np.prod(np.subtract(arm.box_high_m, arm.box_low_m) ** 2 / 12.0)
    cov = env.unwrapped.loop.odometry.source()[1]
    assert sum(gain for _, gain, _, _ in kept) == pytest.approx(0.5 * np.log(anywhere / np.linalg.det(cov)))
    assert np.sqrt(np.trace(cov)) == pytest.approx(info["sd_m"])


def test_a_bench_is_kept_and_its_searches_differ_in_source_turbulence_and_noise(searching):
    env = searching()
    places = []
    for seed in (1, 2):
        env.reset(seed=seed)
        places.append(env.step(np.zeros(3, dtype=np.float32))[4]["truth"]["source_m"])
    assert np.linalg.norm(places[0] - places[1]) > 1e-3


def test_time_is_charged(searching):
    dear, free = (episode(searching(second_cost=cost), 2)[0] for cost in (1.0, 0.0))
    spent = [b[1] - a[1] for a, b in zip(dear[1:], free[1:], strict=True)]
    assert min(spent) > 0.3  # a sniff takes longer than its dwell


def _quick_vector_env():
    import oio.gym  # noqa: F401

    told = {"stage.calibrate_bouts.moves_per_rung": 1, "stage.map_beliefs.repeats": 2, "stage.map_beliefs.budget_s": 0}
    return gymnasium.make("OIO/Search-v0", sensor="ndir", dof=3, bench_seeds=(3,), overrides={**told, "stage.navigate.max_moves": 6})


@pytest.mark.slow
def test_vectors_of_environments_agree(searching):
    """In one process and in several, past the end of an episode."""
    found = []
    for kind in (SyncVectorEnv, AsyncVectorEnv):
        envs = kind([_quick_vector_env] * 2)
        told, _ = envs.reset(seed=[1, 2])
        envs.action_space.seed(0)
        kept = [as_bytes(told)]
        for _ in range(9):
            told, gain, *_ = envs.step(envs.action_space.sample())
            kept.append(as_bytes(told) + gain.tobytes())
        envs.close()
        found.append(kept)
    assert found[0] == found[1]


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ({"frame": "arm"}, "frame is 'arm', but it can be box or source"),
        ({"reward": "money"}, "reward is 'money', but it can be information or log_score"),
        ({"bench_seeds": ()}, "bench_seeds is empty"),
        ({"bench_seeds": 3}, "bench_seeds is 3, but it is a list"),
        ({"bench_seeds": (1.5,)}, "bench_seeds is .1.5,., but it is a list"),
        ({"bench_seeds": "0123"}, "bench_seeds is '0123', but it is a list"),
        ({"sensor": "nose"}, "nose"),
        ({"overrides": {"seed": 3}}, "overrides has seed"),
        ({"overrides": {"stop.sd_m": 10}}, "stop.sd_m is 10"),
        ({"overrides": {"stage.navigate.max_moves": 0}}, "stage.navigate.max_moves is 0, but 4 to 10000 is allowed"),
        ({"declared": "much"}, "declared is 'much', but a finite number"),
    ],
)
def test_what_is_wrong_is_refused_as_it_is_made(searching, words, told):
    with pytest.raises(BadInput, match=told):
        searching(**words)


def test_there_is_no_step_before_an_episode_nor_after_it(searching):
    env = searching(overrides={"stage.navigate.max_moves": 6}).unwrapped
    for _ in range(2):
        with pytest.raises(ResetNeeded, match=r"call env\.reset"):
            env.step(np.zeros(3))
        env.reset(seed=0)
        while not any(env.step(np.zeros(3))[2:4]):
            pass
    with pytest.raises(ResetNeeded):
        env.step(np.zeros(3))


def test_wrong_actions_and_options_are_refused(searching):
    env = searching().unwrapped
    with pytest.raises(BadInput, match="world_seed alone"):
        env.reset(options={"place": 1})
    env.reset(seed=0)
    for action in (np.zeros(2), np.full(3, np.nan), "left", [None, {}, 1]):
        with pytest.raises(BadInput, match="three finite numbers"):
            env.step(action)
