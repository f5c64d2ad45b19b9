"""Exposures to a source whose place is known, and what the bout rule made of them: measured, where `oio.gas.bout_rates` simulates.

An approach is a stretch of measurements near the source, from the move toward it to the move away; it is detected if the rule fires in it.
The paper's rule fires where growth grows: at about half of all readings in gas, whether the nose comes or goes. Hence the share of single
measurements on which it fires, near and away, stands beside: where both are alike, a bout tells gas from clean air, but not whether the
nose comes nearer.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from oio.core.records import GasReading, nanoseconds
from oio.gas.bout_rates import Rate
from oio.gas.detection_rule import Detector
from oio.gas.trace import Sniffs


@dataclass(frozen=True, slots=True)
class Exposures:
    """Approaches to a known source on which the bout rule fired, and single measurements near it and away from it on which it did."""

    approaches: Rate
    near: Rate
    away: Rate


def exposures(detector: Detector, sniffs: Sniffs, ends_s: Sequence[float], near: Sequence[bool]) -> Exposures:
    """Return what a fresh detector makes of the readings. `ends_s` (m + 1,): time before the first of m measurements, and their ends;
    `near` (m,): whether each was near the source. Measurements without a reading are left out."""
    times, fired = sniffs.reading_t_s, _fired(detector, sniffs)
    spans = zip(ends_s[:-1], ends_s[1:], near, strict=True)
    found = [(bool(np.any(fired[inside])), close) for begin, end, close in spans if np.any(inside := (times > begin) & (times <= end))]
    approaches = list[bool]()
    for i, (bout, close) in enumerate(found):
        if close and i and found[i - 1][1]:
            approaches[-1] |= bout
        elif close:
            approaches.append(bout)
    return Exposures(_rate(approaches), _rate([b for b, close in found if close]), _rate([b for b, close in found if not close]))


def _fired(detector: Detector, sniffs: Sniffs) -> NDArray[np.bool_]:
    """Whether the rule fired at each reading (m,)."""
    columns = zip(sniffs.reading_t_s.tolist(), sniffs.element.tolist(), sniffs.ppm.tolist(), sniffs.sigma_ppm.tolist(), strict=True)
    bouts = [detector.feed(GasReading(nanoseconds(t_s), element, ppm, sigma)) for t_s, element, ppm, sigma in columns]
    return np.array([bout is not None and bout.fired for bout in bouts], dtype=np.bool_)


def _rate(fired: list[bool]) -> Rate:
    return Rate(sum(fired), len(fired))
