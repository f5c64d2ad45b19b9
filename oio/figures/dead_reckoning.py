"""Dead reckoning from a log alone: forward kinematics of the encoders, by the MJCF that is attached to the log."""

import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from oio.core.errors import BadInput
from oio.core.records import Array, JointState
from oio.kinematics.chain_from_model import KinematicChain, load_chain
from oio.kinematics.forward import SerialChain, nose_and_jacobian
from oio.log import read_attachment
from oio.results.yaml_fields import plain_yaml


@dataclass(frozen=True, eq=False)
class Encoders:
    """An arm whose encoders are taken as exact; joints that do not move stay at `locked` (m,) rad."""

    chain: KinematicChain
    locked: Array

    @property
    def shoulder_m(self) -> Array:
        """Position of the first joint (3,) m."""
        return self.chain.poses[0, :3, 3]

    def links(self, q: Array) -> Array:
        """Return the base, every joint and the nose (j + 2, 3) m of joints q (n,)."""
        c = self.chain
        chains = [SerialChain(c.poses[:j], c.axes[:j], c.kinds[:j], self.locked[:j], np.zeros(3)) for j in range(1, len(c.names) + 1)]
        joints = [nose_and_jacobian(q[None, : len(chain.axes)], chain, False)[0][0] for chain in chains]
        whole = SerialChain(c.poses, c.axes, c.kinds, self.locked, c.nose_offset)
        return np.array([np.zeros(3), *joints, nose_and_jacobian(q[None, :], whole, False)[0][0]])

    def noses(self, joints: Iterable[JointState]) -> Iterator[tuple[int, Array]]:
        """Yield (t_ns, nose (3,) m) of every joint state."""
        c, states = self.chain, list(joints)
        if states:
            q = np.array([state.q for state in states])
            noses, _ = nose_and_jacobian(q, SerialChain(c.poses, c.axes, c.kinds, self.locked, c.nose_offset), False)
            yield from zip((state.t_ns for state in states), noses, strict=True)


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
        document: Any = plain_yaml(read_attachment(path, "config.yaml").decode(), "config.yaml", "")
        home = np.array(document["arm"]["home_rad"], dtype=np.float64)
    except (BadInput, KeyError, TypeError, ValueError):
        return None
    return home if home.shape == (joints,) else None
