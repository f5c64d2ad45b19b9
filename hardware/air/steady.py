"""Steady advection-diffusion from a point source: C = q / (4 pi K r) exp(-(U r - U.(p - s)) / 2K). Analytic, for tests."""

import math
from dataclasses import dataclass

import numpy as np

from oio.core.records import Array
from oio.core.settings import in_range, settings


@settings
class Steady:
    """Air without turbulence: analytic steady-state plume."""

    name: str
    diffusivity_m2_s: float  # K
    wind_m_s: tuple[float, float, float]  # U

    def check(self) -> None:
        """Refuse a diffusivity out of range."""
        in_range(self, diffusivity_m2_s=(1e-6, 10.0))

    def open(self, truth: np.random.Generator, disturbance: np.random.Generator) -> "LiveSteady":
        """Create the live air; it is deterministic."""
        return LiveSteady(self)


@dataclass(slots=True)
class LiveSteady:
    """Concentration field of one source."""

    air: Steady
    source_m: Array | None = None
    emission_ml_s: float = 0.0

    def present(self, source_m: Array | None, emission_ml_s: float) -> None:
        """Replace the source; its steady-state field is present at once."""
        self.source_m, self.emission_ml_s = source_m, emission_ml_s

    def step(self, dt_s: float) -> None:
        """Do nothing: the field is steady."""

    def ppm(self, p_m: Array) -> float:
        """Concentration above background at (3,) m; finite at the source itself (radius 1 mm)."""
        if self.source_m is None:
            return 0.0
        k, wind, away = self.air.diffusivity_m2_s, self.air.wind_m_s, (p_m - self.source_m).tolist()
        r = max(math.hypot(*away), 1e-3)
        upwind = (math.hypot(*wind) * r - sum(u * x for u, x in zip(wind, away, strict=True))) / (2 * k)
        return self.emission_ml_s / (4 * math.pi * k * r) * math.exp(-max(upwind, 0.0))
