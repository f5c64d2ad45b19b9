"""Nose trajectories along one search: true, dead reckoning, and as estimated by each filter variant."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from oio.core.records import Array, JointState, Truth, WorldSample
from oio.kinematics.arm import Arm
from oio.results.rescoring import Rescoring


@dataclass(frozen=True, eq=False)
class Tracks:
    """Nose positions (k, 3) [m]: true, by dead reckoning, and per variant as estimated since its first map (the last k' of them).

    `sources`: (mean (3,) m, cov (3, 3) m^2) at the end; `source_m` is the true source, None if not logged.
    """

    true_m: Array
    dead_m: Array
    believed_m: Mapping[str, Array]
    sources: Mapping[str, tuple[Array, Array]]
    source_m: Array | None


@dataclass(slots=True)
class _Points:
    true: list[Array] = field(default_factory=list)
    dead: list[Array] = field(default_factory=list)
    believed: dict[str, list[Array]] = field(default_factory=dict)


def tracks(rerun: Rescoring, arm: Arm, samples: Iterable[WorldSample]) -> Tracks:
    """Run the variants of `rerun` over the samples of a search and record the nose trajectories at the stamps of the truth."""
    points = _Points(believed={name: [] for name in rerun.variants})
    rerun.run(_recorded(rerun, arm, samples, points))
    sources = {name: variant.odometry.source() for name, variant in rerun.variants.items()}
    return Tracks(
        _positions(points.true), _positions(points.dead), {name: _positions(found) for name, found in points.believed.items()},
        {name: source for name, source in sources.items() if source is not None}, rerun.source,
    )  # fmt: skip


def _recorded(rerun: Rescoring, arm: Arm, samples: Iterable[WorldSample], points: _Points) -> Iterator[WorldSample]:
    """Pass the samples on and record nose positions: when the next sample is requested, the variants have processed the last."""
    joints: JointState | None = None
    for sample in samples:
        yield sample
        if isinstance(sample, JointState):
            joints = sample
        if not isinstance(sample, Truth) or joints is None or joints.t_ns != sample.t_ns:
            continue
        points.true.append(sample.nose_m)
        points.dead.append(arm.nose(joints.q))
        for name, variant in rerun.variants.items():
            nose = variant.odometry.nose()
            if nose is not None:
                points.believed[name].append(nose[0])


def _positions(points: list[Array]) -> Array:
    return np.array(points, dtype=np.float64).reshape(-1, 3)
