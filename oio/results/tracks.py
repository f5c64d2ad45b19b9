"""Where the nose was, and where the filter had it before and after calibration, along one search."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from oio.core.records import Array, JointState, Truth, WorldSample
from oio.kinematics.arm import Arm
from oio.results.rescoring import Rescoring


@dataclass(frozen=True, eq=False)
class Tracks:
    """Places (k, 3) m of the nose: true, by the encoders, and per variant as believed since its first map (the last k' of them).

    `sources`: (mean (3,) m, cov (3, 3) m^2) at the end; `source_m` is the truth, None where the log holds none.
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
    """Run the variants of `rerun` over the samples of a search and note every nose at every truth."""
    points = _Points(believed={name: [] for name in rerun.variants})
    rerun.over(_watched(rerun, arm, samples, points))
    sources = {name: variant.odometry.source() for name, variant in rerun.variants.items()}
    return Tracks(
        _rows(points.true), _rows(points.dead), {name: _rows(found) for name, found in points.believed.items()},
        {name: source for name, source in sources.items() if source is not None}, rerun.source,
    )  # fmt: skip


def _watched(rerun: Rescoring, arm: Arm, samples: Iterable[WorldSample], points: _Points) -> Iterator[WorldSample]:
    """The samples; when the next one is asked for, the variants have been fed the last."""
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


def _rows(points: list[Array]) -> Array:
    return np.array(points, dtype=np.float64).reshape(-1, 3)
