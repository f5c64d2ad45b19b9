"""`Setup`: which sensor, which arm, and the numbers of the model, composed from conf/ without a command line."""

import difflib
import functools
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from oio.api import array_input
from oio.core.errors import BadInput
from oio.core.folders import CONF
from oio.core.interfaces import Sensor
from oio.core.shipped_code import use_shipped
from oio.kinematics.arm import Arm

WITHOUT_ARM = "gantry"  # three axes that slide stand for a nose without an arm
MARGIN_M = 0.3  # of the box about a nose path, in which its source is looked for


@dataclass(frozen=True)
class Setup:
    """Sensor and arm of an experiment, and every number of its model.

    `sensor`, `arm`, `profile`: choices of conf/ (ec, ndir, ...; so101, gantry; paper, datasheet). `dof`: how many joints move.
    `overrides`: further keys as on the command line, e.g. {"nominal.rise_s": 4.0, "air": "draft"}. Composed at once; raises BadInput for a
    key or a choice that does not exist, or a value out of range.
    """

    sensor: str = "ec"
    dof: int = 5
    arm: str = "so101"
    profile: str = "paper"
    overrides: Mapping[str, object] = field(default_factory=dict)

    def __post_init__(self) -> None:
        array_input.expected("overrides", self.overrides, Mapping, "{'nominal.rise_s': 4.0}")
        use_shipped()
        with in_one_paragraph():
            from oio.cli.unread_keys import refuse_unread

            refuse_unread(self._composed.cfg)
        _ = self.robot, self.nose, self.part("nominal")

    @property
    def words(self) -> list[str]:
        """The same as words of the command line."""
        chosen = {"sensor": self.sensor, "dof": self.dof, "arm": self.arm, "profile": self.profile}
        return [f"{key}={as_word(value)}" for key, value in {**chosen, **self.overrides}.items()]

    @functools.cached_property
    def _composed(self) -> Any:
        from oio.cli.compose import compose

        return compose(self.words, ())

    def number(self, key: str) -> Any:
        """The value of one key of the configuration."""
        from omegaconf import OmegaConf

        return OmegaConf.select(self._composed.cfg, key)

    def part(self, key: str) -> Any:
        """What the configuration builds of one key, e.g. `belief_map`; frozen, built once. Raises BadInput where it has none."""
        if key not in self._built:
            from hydra.utils import instantiate

            self._refuse_missing(key)
            with in_one_paragraph():
                self._built[key] = instantiate(self.number(key), _convert_="all")
        return self._built[key]

    def _refuse_missing(self, key: str) -> None:
        if self.number(key) is None:
            near = difflib.get_close_matches(key, list(self._composed.cfg), 1)
            example = f"Give '{near[0]}'." if near else "Give e.g. 'belief_map'."
            raise BadInput(f"'{key}' was asked for, but the configuration has nothing under this key. {example}")

    @functools.cached_property
    def _built(self) -> dict[str, Any]:
        return {}

    @property
    def robot(self) -> Arm:
        """The arm, with `dof` joints unlocked."""
        arm = self.part("arm")
        assert isinstance(arm, Arm)
        return arm

    @property
    def nose(self) -> Sensor:
        """The sensor."""
        sensor = self.part("sensor")
        assert isinstance(sensor, Sensor)
        return sensor

    def without_arm(self) -> Self:
        """The same sensor and model for a nose whose position is given: three axes that slide."""
        if self.arm == WITHOUT_ARM:
            return self
        kept = {key: value for key, value in self.overrides.items() if key.split(".")[0] not in ("arm", "dof")}
        return replace(self, arm=WITHOUT_ARM, dof=3, overrides=kept)

    def boxed(self, box_m: ArrayLike) -> Arm:
        """The arm with another box: its lower and upper corner (2, 3) [m], between which the source is."""
        low, high = array_input.matrix("box_m", box_m, 2, 3)
        if np.max(np.abs((low, high))) > array_input.FARTHEST_M:
            raise BadInput(
                f"box_m is from {low.tolist()} to {high.tolist()}, but m are wanted, {array_input.FARTHEST_M:g} at most. Divide mm by 1000."
            )
        if not np.all(low < high):
            raise BadInput(
                f"box_m is from {low.tolist()} to {high.tolist()} m, but it must have a size on every axis. Give (lower, upper)."
            )
        return replace(self.robot, box_low_m=tuple(low.tolist()), box_high_m=tuple(high.tolist()))


def as_word(value: object) -> str:
    """A value as on the command line: text is quoted where it must be. Raises BadInput for what no key can take."""
    match value:
        case None:
            return "null"
        case bool():
            return str(value).lower()
        case int() | float() | np.integer() | np.floating():
            return repr(value.item() if isinstance(value, np.generic) else value)
        case str():
            plain = value.replace("_", "").isalnum() and value.isascii()
            return value if plain else "'" + value.replace("\\", "\\\\").replace("'", "\\'") + "'"
        case list() | tuple() | np.ndarray():
            return f"[{','.join(as_word(entry) for entry in value)}]"
    raise BadInput(f"{value!r} was given as the value of a key, but it can be a number, a text, true or false, None, or a list of these.")


@contextmanager
def in_one_paragraph() -> Iterator[None]:
    """Raise Hydra's errors as BadInput, in one paragraph; others pass."""
    try:
        yield
    except Exception as error:
        from oio.cli.hydra_errors import known_error

        known = known_error(error, CONF)
        if known is None or known is error:
            raise
        raise known from None
