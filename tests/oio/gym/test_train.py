"""What `search=policy` was trained on is what it sees: features of an observation, and the goals of the environment."""

import numpy as np
import pytest

from oio.bench.trial import experiment
from oio.core.errors import BadInput
from oio.gym import train
from oio.log import MemoryLog
from oio.results.calibration import Navigation
from oio.runtime.runner import run_stages
from oio.search.policy_network import FEATURES


def test_features_of_an_episode_stay_in_their_space(searching):
    env = train.FeaturesEnv(searching(frame="source").unwrapped)
    env.action_space.seed(0)
    told, _ = env.reset(seed=0)
    for _ in range(2):
        assert told.shape == (FEATURES,) and env.observation_space.contains(told)
        told, *_ = env.step(env.action_space.sample())


def test_the_environment_makes_the_run_of_search_policy(searching, tmp_path):
    """Actions of the policy in an episode: the same moves, to the bit, as in the run of that seed."""
    words = {"search": "policy"}
    env = searching(moves=8, overrides=words, frame="source", bench_seeds=None).unwrapped
    env.reset(options={"world_seed": 5})
    built = experiment(env._words, 5)
    policy, over = built.stages["navigate"].search, False
    while not over:
        *_, terminated, truncated, _ = env.step(policy.action(env.view, env.episode.context.rng))
        over = terminated or truncated
    stages = {name: stage for name, stage in built.stages.items() if name != "evaluate"}
    with built.backend.open() as world:
        run = run_stages(stages, world, built.arm, MemoryLog(), tmp_path, 5, built.sensor.highest_raw)[Navigation]
    np.testing.assert_array_equal([move.q for move in run.made], [move.q for move in env.loop.moves])
    assert run.source_m == tuple(env.loop.odometry.source()[0])


def test_kinds_of_training_are_not_those_of_the_report():
    assert not {"ec", "mox_mics"} & {sensor for sensor, _ in train.KINDS}
    assert all(300 <= seed < 400 for seed in train.BENCHES)


def test_words_are_read_or_refused(tmp_path):
    read = train.parsed(["steps=512", f"out={tmp_path / 'my.npz'}"])
    assert (read.steps, read.seed, read.out) == (512, 300, tmp_path / "my.npz")
    for word in ("steps=few", "steps=0", "seed=-1", "out=", "pace=3"):
        with pytest.raises(BadInput, match="was given, but steps and seed are whole numbers"):
            train.parsed([word])
