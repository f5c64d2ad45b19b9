"""Spaces and arrays of the environments: every entry within [-1, 1], as float32."""

import math
from collections.abc import Mapping
from typing import cast

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from numpy.typing import ArrayLike, NDArray

from oio.core.errors import BadInput
from oio.core.records import Array

Floats = NDArray[np.float32]


def space_of(shapes: Mapping[str, tuple[int, ...]]) -> gymnasium.Space[dict[str, Floats]]:
    """A space of arrays of these shapes."""
    made = spaces.Dict({name: spaces.Box(-1.0, 1.0, shape, np.float32) for name, shape in shapes.items()})
    return cast("gymnasium.Space[dict[str, Floats]]", made)


def as_floats(arrays: Mapping[str, Array]) -> dict[str, Floats]:
    """Arrays as float32, rounding included within [-1, 1]."""
    return {name: np.clip(value, -1.0, 1.0).astype(np.float32) for name, value in arrays.items()}


def finite_number(name: str, value: float) -> float:
    """The number given as `name`. Raises BadInput for what is none."""
    if not isinstance(value, int | float) or not math.isfinite(value):
        raise BadInput(f"{name} is {value!r}, but a finite number is needed. Leave it out for the usual one.")
    return float(value)


def refuse_ended(over: bool) -> None:
    """Raise ResetNeeded if an episode is over, or has not begun."""
    if over:
        raise ResetNeeded("the episode is over, or has not begun: call env.reset() before env.step().")


def checked_action(action: ArrayLike) -> Array:
    """An action (3,), clipped to [-1, 1]. Raises BadInput for another shape, and for what is no finite number."""
    try:
        given = np.asarray(action, dtype=np.float64)
    except (TypeError, ValueError):
        raise BadInput(f"step was given the action {action!r:.80}, but three finite numbers from -1 to 1 are wanted.") from None
    if given.shape != (3,) or not np.all(np.isfinite(given)):
        raise BadInput(f"step was given the action {np.round(given, 3).tolist()}, but three finite numbers from -1 to 1 are wanted.")
    return np.clip(given, -1.0, 1.0)
