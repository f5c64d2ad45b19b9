"""`python -m oio.gym.train`: train the network of `search=policy` by proximal policy optimisation (PPO, Schulman et al. 2017)."""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from oio.core import startup

startup.handle_signals(__name__)

import gymnasium
import numpy as np
from gymnasium import spaces

from oio.cli import terminal
from oio.cli.exit_codes import run_command
from oio.core.errors import BadInput
from oio.core.folders import ROOT
from oio.gym.arrays import Floats
from oio.gym.search_env import SearchEnv
from oio.search.policy_network import FEATURES, PolicyNetwork, features

KINDS = (("ndir", "still"), ("mox_mq", "draft"), ("pa", "steady"), ("mox_mq", "still"))  # sensor and air of each environment
BENCHES = (300, 301)  # seeds of their benches
OVERRIDES = {  # short, in the world of calibration alone, and with fewer and cheaper belief maps
    "stage.navigate.max_moves": 40,
    "stage.navigate.mapping.recheck_moves": 10,
    "stage.navigate.mapping.remap_factor": 1.5,
    "belief_map.alternatives.worlds": [],
    "belief_map.starts": 3,
    "belief_map.restarts": 1,
    "belief_map.points_per_shell": 8,
}
DEFAULTS = {"steps": 3840, "seed": 300, "out": str(ROOT / "oio" / "search" / "policy.npz")}
HELP = """Train the network of search=policy in OIO/Search-v0 (needs stable-baselines3; five minutes of one core).

  python -m oio.gym.train                                  the network of the repository, made anew
  python -m oio.gym.train steps=2048 seed=301 out=my.npz   then: search=policy search.network=my.npz
"""


class FeaturesEnv(gymnasium.ObservationWrapper[Floats, Floats, dict[str, Floats]]):
    """`OIO/Search-v0` with the features of `search=policy` as its observation, Box(-1, 1, (FEATURES,))."""

    def __init__(self, env: SearchEnv) -> None:
        super().__init__(env)
        self.observation_space = spaces.Box(-1.0, 1.0, (FEATURES,), np.float32)

    def observation(self, observation: dict[str, Floats]) -> Floats:
        """Features of an observation."""
        return features({name: value.astype(np.float64) for name, value in observation.items()}).astype(np.float32)


@dataclass(frozen=True)
class Training:
    """Number of moves, seed, and the file of the network."""

    steps: int
    seed: int
    out: Path


def training_env(sensor: str, air: str) -> FeaturesEnv:
    """The environment of one kind."""
    return FeaturesEnv(SearchEnv(sensor, air=air, overrides=OVERRIDES, frame="source", reward="log_score", bench_seeds=BENCHES))


def train(training: Training) -> PolicyNetwork:
    """Train, and return the network. The same seed gives the same network with the same libraries and processor."""
    try:
        import torch
        from stable_baselines3 import PPO
        from stable_baselines3.common.vec_env import DummyVecEnv
    except ModuleNotFoundError as error:
        raise BadInput(f"training needs {error.name}, which is not installed. Type pip install stable-baselines3.") from None
    torch.set_num_threads(1)
    envs = DummyVecEnv([lambda kind=kind: training_env(*kind) for kind in KINDS])  # type: ignore[misc,unused-ignore]
    model = PPO(
        "MlpPolicy", envs, n_steps=64, batch_size=64, n_epochs=10, learning_rate=1e-3, gamma=0.95, gae_lambda=0.9, ent_coef=0.0,
        policy_kwargs={"net_arch": [32, 32], "log_std_init": -0.7}, seed=training.seed, device="cpu", verbose=0,
    )  # fmt: skip
    model.learn(training.steps)
    return network_of(model.policy)


def network_of(policy: Any) -> PolicyNetwork:
    """The network of a policy of stable-baselines3 with one hidden part of its own for actions."""
    layers = [layer for layer in policy.mlp_extractor.policy_net if hasattr(layer, "weight")] + [policy.action_net]
    weights, biases = ([getattr(layer, name).detach().numpy().astype(np.float64) for layer in layers] for name in ("weight", "bias"))
    return PolicyNetwork(tuple(weights), tuple(biases), policy.log_std.detach().numpy().astype(np.float64))


def parsed(arguments: list[str]) -> Training:
    """The training of a command line KEY=VALUE. Raises BadInput for another key or value."""
    given: dict[str, Any] = {**DEFAULTS}
    for word in arguments:
        key, _, text = word.partition("=")
        whole = text.isdecimal() and len(text) < 10 and (key == "seed" or int(text) > 0)
        if key not in DEFAULTS or not (text if key == "out" else whole):
            raise BadInput(f"'{word}' was given, but steps and seed are whole numbers and out is a file. Type e.g. steps=2048 out=my.npz.")
        given[key] = text if key == "out" else int(text)
    return Training(given["steps"], given["seed"], Path(given["out"]))


def _run(arguments: list[str]) -> None:
    if {"--help", "-h"} & set(arguments):
        terminal.console(soft_wrap=True, highlight=False).print(HELP.rstrip(), markup=False)
        return
    training = parsed(arguments)
    train(training).save(training.out)
    terminal.console(soft_wrap=True).print(f"the network is in {training.out}", markup=False)


if __name__ == "__main__":
    sys.exit(run_command(lambda: _run(sys.argv[1:])))
