"""Learned search: a small network, trained in `OIO/Search-v0`, says where about the believed source the nose goes next.

Without a belief it explores as `d_optimal` does. `python -m oio.gym.train` makes the network; nothing of the training is needed here.
"""

from functools import cached_property
from pathlib import Path

import numpy as np

from oio.core.folders import ROOT
from oio.core.records import Array
from oio.core.settings import settings
from oio.search.exploration import explore
from oio.search.observation import observe
from oio.search.policy_network import PolicyNetwork, features, load_network
from oio.search.targets import source_goal
from oio.search.view import View


@settings
class Policy:
    """Policy that was learned by reinforcement; frozen, its network is read once."""

    network: str  # file of the network; a relative path is one of the project's own, or counts from the current folder

    def check(self) -> None:
        """Refuse a file that holds no network."""
        _ = self._network

    @cached_property
    def _network(self) -> PolicyNetwork:
        own = ROOT / self.network
        return load_network(own if own.is_file() else Path(self.network).absolute())

    def propose(self, view: View, rng: np.random.Generator) -> Array:
        """Return the next joint goal (n,) rad."""
        if view.belief is None:
            return explore(view, rng)
        return source_goal(view, self.action(view, rng), rng)

    def action(self, view: View, rng: np.random.Generator) -> Array:
        """The action (3,) in `OIO/Search-v0` with frame="source"; the observation is rounded as it is there."""
        told = {name: value.astype(np.float32).astype(np.float64) for name, value in observe(view).items()}
        return self._network.drawn(features(told), rng)
