"""A small neural network that was learned elsewhere: features of an observation in, mean and spread of an action out; NumPy alone."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from oio.core.errors import BadInput
from oio.core.records import Array
from oio.search.observation import Observation

NEAR = 4.0  # places relative to the source are magnified by this
ACTION = 3
FEATURES = 69


def features(told: Observation) -> Array:
    """Features (FEATURES,) of an observation, each within [-1, 1]: places relative to the believed source, joints left out, so that they
    are the same for every arm. Computed from the observation alone."""
    source, hypotheses, sniffs = told["source"], np.array(told["hypotheses"]), np.array(told["sniffs"])
    known, made = hypotheses[:, 3] != 0.0, np.any(sniffs != 0.0, axis=1)
    hypotheses[known, :3] = NEAR * (hypotheses[known, :3] - source)
    sniffs[made, :3] = NEAR * (sniffs[made, :3] - source)
    parts = (
        NEAR * (told["nose"] - source), source, told["source_sd"], told["source_correlation"], hypotheses.ravel(), told["law"],
        sniffs.ravel(), told["moves"],
    )  # fmt: skip
    return np.clip(np.concatenate(parts), -1.0, 1.0)


@dataclass(frozen=True, eq=False)
class PolicyNetwork:
    """Layers of weights (k_out, k_in) and biases (k_out,), hyperbolic tangents between them, and the logarithm of the spread (3,)."""

    weights: tuple[Array, ...]
    biases: tuple[Array, ...]
    ln_spread: Array

    def mean(self, x: Array) -> Array:
        """The mean action (3,) at features x (FEATURES,)."""
        for weight, bias in zip(self.weights[:-1], self.biases[:-1], strict=True):
            x = np.tanh(weight @ x + bias)
        return np.asarray(self.weights[-1] @ x + self.biases[-1])

    def drawn(self, x: Array, rng: np.random.Generator) -> Array:
        """An action (3,) drawn from a normal distribution about the mean, clipped to [-1, 1]: as it was learned."""
        return np.clip(self.mean(x) + np.exp(self.ln_spread) * rng.standard_normal(ACTION), -1.0, 1.0)

    def save(self, path: Path) -> None:
        """Write the arrays, as float32, to an .npz file without pickles."""
        layers = {f"weight_{i}": weight for i, weight in enumerate(self.weights)}
        layers |= {f"bias_{i}": bias for i, bias in enumerate(self.biases)}
        arrays = {name: np.asarray(value, dtype=np.float32) for name, value in (layers | {"ln_spread": self.ln_spread}).items()}
        with path.open("wb") as file:
            np.savez(file, **arrays)  # type: ignore[arg-type]  # its flag allow_pickle is for objects


def load_network(path: Path) -> PolicyNetwork:
    """Read what `PolicyNetwork.save` wrote. Raises BadInput for a file that is missing, or is none of these."""
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: np.asarray(file[name], dtype=np.float64) for name in file.files}
    except (OSError, ValueError, EOFError, KeyError) as error:
        raise BadInput(f"search.network is {path}, but it cannot be read as a network ({error}). Type python -m oio.gym.train.") from None
    count = sum(name.startswith("weight_") for name in arrays)
    try:
        network = PolicyNetwork(
            tuple(arrays[f"weight_{i}"] for i in range(count)), tuple(arrays[f"bias_{i}"] for i in range(count)), arrays["ln_spread"]
        )
        fits = network.mean(np.zeros(FEATURES)).shape == network.ln_spread.shape == (ACTION,)
    except (KeyError, IndexError, ValueError):
        fits = False
    if not fits:
        raise BadInput(
            f"search.network is {path}, but its layers do not lead from {FEATURES} features to {ACTION} numbers. "
            f"Type python -m oio.gym.train."
        )
    if not all(np.all(np.isfinite(array)) for array in arrays.values()):
        raise BadInput(f"search.network is {path}, but it holds numbers that are not finite. Type python -m oio.gym.train.")
    return network
