"""Command line options of `python -m hardware.emulate`, separated from the overrides of the simulated bench."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import yaml

from hardware.backends.mujoco_sim import MujocoSim
from hardware.emulators.faults import Chance, Fault, kinds
from hardware.emulators.faults import read as read_faults
from oio.core.errors import BadInput
from oio.core.settings import Within, settings

SENSORS = {"scd30": "ndir", "scd41": "pa", "line": "ec"}  # default sensor of each nose
ALLOWED = {"nose": tuple(SENSORS), "arm": ("feetech", "dynamixel", "none"), "valve": ("line", "none")}
EXAMPLE = "python -m hardware.emulate nose=scd30 arm=feetech air=draft"


@settings
class EmulatorOptions:
    """Keys of conf/emulate.yaml."""

    nose: str
    arm: str
    gripper: bool
    valve: str
    speed: Annotated[float, Within(0.1, 100)]
    out: str | None
    faults: str | None
    fault_s: Annotated[float, Within(0.01, 3600)]
    random_count: Annotated[int, Within(1, 100)]
    random_within_s: Annotated[float, Within(0, 1e6)]
    random_longest_s: Annotated[float, Within(0.01, 3600)]
    until_eof: bool

    def check(self) -> None:
        """Refuse unknown devices."""
        for key, allowed in ALLOWED.items():
            given = getattr(self, key)
            if given not in allowed:
                raise BadInput(f"{key}={given} was given, but {key} can be {', '.join(allowed)}. Type e.g. {EXAMPLE}.")
        if self.gripper and self.arm != "feetech":
            raise BadInput(f"gripper=true was given with arm={self.arm}, but only arm=feetech has one. Leave it out.")

    def schedule(self) -> tuple[Fault, ...]:
        """Return the fault schedule. Raises BadInput."""
        if self.faults is None:
            return ()
        chance = Chance(self.random_count, self.random_within_s, self.random_longest_s)
        return read_faults(self.faults, kinds(self.nose, self.arm, self.valve), self.fault_s, chance)

    def refuse_another_sensor(self, sim: MujocoSim) -> None:
        """Refuse a sensor that does not fit the nose: a ppm device cannot carry a sensor in ADC counts, and vice versa."""
        counts = hasattr(sim.sensor, "adc_bits")
        if counts != (self.nose == "line"):
            suitable = "nose=line, which says counts" if counts else "nose=scd30 or nose=scd41, which say ppm"
            raise BadInput(f"sensor={sim.sensor.name} goes with {suitable}, but nose={self.nose} was given.")


def read(arguments: Sequence[str], source: Path) -> tuple[EmulatorOptions, list[str]]:
    """Parse the options and the overrides of the bench. Raises BadInput for words that are not KEY=VALUE, duplicates and wrong values."""
    own: dict[str, Any] = yaml.safe_load(source.read_text(encoding="utf-8"))
    words = _words(arguments)
    if "backend" in words:
        raise BadInput(f"backend={words['backend']} was given, but what is emulated is always backend=mujoco. Leave it out.")
    options = _checked({**own, **{key: _value(key, text) for key, text in words.items() if key in own}})
    overrides = [f"{key}={text}" for key, text in words.items() if key not in own]
    return options, overrides if "sensor" in words else [f"sensor={SENSORS[options.nose]}", *overrides]


def _words(arguments: Sequence[str]) -> dict[str, str]:
    words: dict[str, str] = {}
    for word in arguments:
        key, equals, value = word.partition("=")
        if not equals or not key or key.startswith("-"):
            raise BadInput(f"'{word}' was given, but KEY=VALUE words are wanted; --help lists them. Type e.g. {EXAMPLE}.")
        if key in words:
            raise BadInput(f"{key} was given twice. Give it once, e.g. {EXAMPLE}.")
        words[key] = value
    return words


def _value(key: str, text: str) -> object:
    """Convert a value: paths and names stay text; numbers, true and null are as in YAML."""
    if key in (*ALLOWED, "out", "faults"):
        return None if text == "null" else text
    try:
        return yaml.safe_load(text)
    except yaml.YAMLError:
        return text


def _checked(values: Mapping[str, Any]) -> EmulatorOptions:
    try:
        return EmulatorOptions(**values)
    except BadInput as error:
        raise BadInput(str(error).replace("EmulatorOptions.", "", 1)) from None
