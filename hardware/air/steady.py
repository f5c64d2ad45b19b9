"""Steady advection-diffusion from a point source: C = q / (4 pi K r) exp(-(U r - U.(p - s)) / 2K). Analytic, for tests."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from hardware.air.emitter import Emitter
from oio.core.records import Array
from oio.core.settings import Within, settings


@settings
class Steady:
    """Air without turbulence: analytic steady-state plume."""

    name: str
    diffusivity_m2_s: Annotated[float, Within(1e-6, 10)]  # K
    wind_m_s: Annotated[tuple[float, float, float], Within(-10, 10)]  # U

    def open(self, truth: np.random.Generator, disturbance: np.random.Generator) -> "LiveSteady":
        """Create the live air; it is deterministic."""
        return LiveSteady(self, np.array(self.wind_m_s))


SHAPE_POINTS = 64  # by which a line, ring or disc is replaced


@dataclass(slots=True)
class LiveSteady:
    """Concentration field of the open sources; a change of emission or wind takes effect everywhere at once."""

    air: Steady
    wind_m_s: Array
    emitters: tuple[Emitter, ...] = ()
    t_s: float = 0.0

    def present(self, source_m: Array | None, emission_ml_s: float) -> None:
        """Replace all sources by a point, or by none; its steady-state field is present at once."""
        self.emit(() if source_m is None else (Emitter(source_m, emission_ml_s),))

    def emit(self, emitters: Sequence[Emitter]) -> None:
        """Replace all sources."""
        self.emitters, self.t_s = tuple(emitters), 0.0

    def set_wind(self, speed_m_s: float, turned_rad: float, lift_m_s: float) -> None:
        """Change the wind; `turned_rad` is counted from the configured direction, or from x where there is no wind."""
        x, y, _ = self.air.wind_m_s
        angle = math.atan2(y, x) + turned_rad
        self.wind_m_s = np.array([speed_m_s * math.cos(angle), speed_m_s * math.sin(angle), lift_m_s])

    def step(self, dt_s: float) -> None:
        """Count the time, for emissions that change."""
        self.t_s += dt_s

    def ppm(self, p_m: Array) -> float:
        """Concentration above background at (3,) m: sum over the sources, extended ones as SHAPE_POINTS points."""
        return sum((self._of_emitter(emitter, p_m) for emitter in self.emitters), 0.0)

    def _of_emitter(self, emitter: Emitter, p_m: Array) -> float:
        rate = emitter.rate_ml_s * float(emitter.release.share(np.array([self.t_s]))[0])
        if emitter.shape.kind == "point":
            return self._of_point(p_m - emitter.place_m, rate)
        offsets = emitter.shape.offsets_m(0, SHAPE_POINTS)
        return sum(self._of_point(p_m - emitter.place_m - offset, rate / SHAPE_POINTS) for offset in offsets)

    def _of_point(self, away_m: Array, rate_ml_s: float) -> float:
        """Field of a point at displacement (3,) m; finite at the source itself (radius 1 mm)."""
        k, wind, away = self.air.diffusivity_m2_s, self.wind_m_s.tolist(), away_m.tolist()
        r = max(math.hypot(*away), 1e-3)
        upwind = (math.hypot(*wind) * r - sum(u * x for u, x in zip(wind, away, strict=True))) / (2 * k)
        return rate_ml_s / (4 * math.pi * k * r) * math.exp(-max(upwind, 0.0))
