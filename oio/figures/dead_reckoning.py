"""Dead reckoning from a log alone: forward kinematics of the encoders, by the MJCF that is attached to the log."""

import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml

from oio.core.errors import BadInput
from oio.core.records import Array, JointState
from oio.kinematics.chain_from_model import KinematicChain, load_chain
from oio.kinematics.forward import SerialChain, nose_and_jacobian
from oio.log import read_attachment


@dataclass(frozen=True, eq=False)
class Encoders:
    """An arm whose encoders are taken as exact; joints that do not move stay at `locked` (m,) rad."""

    chain: KinematicChain
    locked: Array

    @property
    def shoulder_m(self) -> Array:
        """Position of the first joint (3,) m."""
        return self.chain.poses[0, :3, 3]

    def noses(self, joints: Iterable[JointState]) -> Iterator[tuple[int, Array]]:
        """Yield (t_ns, nose (3,) m) of every joint state."""
        c = self.chain
        for state in joints:
            yield state.t_ns, nose_and_jacobian(state.q[None, :], SerialChain(c.poses, c.axes, c.kinds, self.locked, c.nose_offset))[0][0]


def encoders(path: Path, identity: dict[str, str]) -> Encoders | None:
    """Return the arm of a log; None if the log has no MJCF, or one whose joints do not match."""
    moving = tuple(identity.get("joints", "").split())
    try:
        chain = _chain(read_attachment(path, "arm.mjcf"))
    except BadInput:
        return None
    locked = _home(path, len(chain.names))
    if locked is None and len(moving) == len(chain.names):
        locked = np.zeros(len(moving))  # all joints move: not used
    return Encoders(chain, locked) if locked is not None and chain.names[: len(moving)] == moving else None


def _chain(mjcf: bytes) -> KinematicChain:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "arm.mjcf"
        file.write_bytes(mjcf)
        return load_chain(file)


def _home(path: Path, joints: int) -> Array | None:
    """Home pose of the locked joints, from the attached configuration; None if there is none."""
    try:
        home = np.array(yaml.safe_load(read_attachment(path, "config.yaml"))["arm"]["home_rad"], dtype=np.float64)
    except (BadInput, yaml.YAMLError, KeyError, TypeError, ValueError):
        return None
    return home if home.shape == (joints,) else None
