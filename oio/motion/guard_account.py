"""Account of a guard: the limits that it held an arm to, and how fast the set-points were that it gave."""

import json
import math
from dataclasses import asdict, dataclass

import numpy as np

from oio.core.records import Array
from oio.kinematics.arm import Arm

BATCH = 128  # set-points whose noses are computed at once


@dataclass(frozen=True, slots=True)
class GuardAccount:
    """What a guard held its arm to: names of the limits that are not finite, the top speed [m/s] of the nose by the set-points and the
    limit of it, and the joints whose load was never heard, or whose limit of load nothing can exceed."""

    without_limit: tuple[str, ...]
    top_speed_m_s: float
    speed_limit_m_s: float
    load_unwatched: tuple[str, ...]

    def to_json(self) -> str:
        """As text for the log, from which a replay has it."""
        return json.dumps(asdict(self))

    @staticmethod
    def from_json(text: str) -> "GuardAccount | None":
        """Read a text of a log; None if it is not such an account."""
        try:
            read = json.loads(text)
            limits, loads = (tuple(map(str, read[key])) for key in ("without_limit", "load_unwatched"))
            top_m_s, limit_m_s = (float(read[key]) for key in ("top_speed_m_s", "speed_limit_m_s"))
        except (ValueError, KeyError, TypeError, RecursionError):
            return None
        return GuardAccount(limits, top_m_s, limit_m_s, loads)


def without_limit(arm: Arm) -> tuple[str, ...]:
    """Names of the limits of an arm that are not finite: joints by name, its box, its speeds."""
    joints = [name for name, *limits in zip(arm.names, arm.low_rad, arm.high_rad, strict=True) if not all(map(math.isfinite, limits))]
    others = {
        "arm.box_low_m": arm.box_low_m, "arm.box_high_m": arm.box_high_m, "arm.joint_speed": (arm.joint_speed,),
        "arm.nose_limit_m_s": (arm.nose_limit_m_s,),
    }  # fmt: skip
    return (*joints, *(name for name, limits in others.items() if not all(map(math.isfinite, limits))))


class CommandedTrack:
    """Set-points as an arm was given them, and the top speed of the nose along them."""

    def __init__(self, arm: Arm) -> None:
        self._arm, self._top_m_s = arm, 0.0
        self._t_s, self._q = list[float](), list[Array]()

    def restart(self) -> None:
        """Begin elsewhere: no speed leads from the last set-point to the next."""
        self._measure()
        self._t_s, self._q = [], []

    def add(self, t_s: float, q: Array) -> None:
        """Add a set-point (n,) rad at t_s; it replaces those that are no earlier, as when a clock runs backwards."""
        while self._t_s and t_s <= self._t_s[-1]:
            self._t_s.pop()
            self._q.pop()
        self._t_s.append(t_s)
        self._q.append(q)
        if len(self._t_s) >= BATCH:
            self._measure()

    def _measure(self) -> None:
        if len(self._t_s) < 2:
            return
        noses = self._arm.nose(np.array(self._q))
        speeds = np.linalg.norm(np.diff(noses, axis=0), axis=1) / np.diff(self._t_s)
        self._top_m_s = max(self._top_m_s, float(np.max(speeds)))
        self._t_s, self._q = self._t_s[-1:], self._q[-1:]

    @property
    def top_speed_m_s(self) -> float:
        """Top speed of the nose so far [m/s]."""
        self._measure()
        return self._top_m_s
