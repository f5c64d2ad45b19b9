"""The experiment that Hydra built: everything of a run, frozen."""

import json
import platform
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import metadata
from typing import Any

from oio import __version__
from oio.cli import git_state
from oio.cli.input_files import inputs_in_words
from oio.core.interfaces import Backend, Sensor
from oio.core.records import Array
from oio.kinematics.arm import Arm
from oio.procedure.procedure import Procedure
from oio.results.verdict import Criteria
from oio.runtime.runner import Stage
from oio.view.base import NoView, View

PACKAGES = ("numpy", "scipy", "mujoco", "numba", "hydra-core", "mcap", "filterpy")


@dataclass(frozen=True)
class Experiment:
    """Everything of a run, frozen; `identity` are the choices that summary.json repeats."""

    arm: Arm
    sensor: Sensor
    backend: Backend
    stages: Mapping[str, Stage]
    verdict: Criteria
    identity: dict[str, Any]
    config_yaml: str
    overrides: list[str]
    procedure: Procedure | None = None  # the protocol of a laboratory
    logged: bool = True  # to run.mcap; else nothing of the run is kept but its numbers
    beacon_m: Array | None = None  # (3,) in frame base, where it is known
    trials: int = 1  # whole runs in memory, which differ in their seeds
    plain: Mapping[str, Any] = field(
        default_factory=dict
    )  # the configuration before interpolation, from which it is built for another seed
    view: View = field(default_factory=NoView)

    @property
    def seed(self) -> int:
        """The root of all random streams."""
        return int(self.identity["seed"])

    def about(self) -> dict[str, str]:
        """Metadata record `oio.run` of the log: choices, configuration, overrides, hashes of input files, versions, git state."""
        named = {key: str(value) for key, value in self.identity.items()}
        inputs = inputs_in_words(self.plain)
        return {
            **named, **({"inputs": json.dumps(inputs)} if inputs else {}), "config": self.config_yaml,
            "overrides": json.dumps(self.overrides), "versions": json.dumps(versions()), "git": git_state.commit(),
            "clock": "simulated or device seconds since the world opened",
        }  # fmt: skip


def versions() -> dict[str, str]:
    """Return the versions of the project, of Python and of the packages on which numbers depend."""
    return {"oio": __version__, "python": platform.python_version(), **{name: _version(name) for name in PACKAGES}}


def _version(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "not installed"
