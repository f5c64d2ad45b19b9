"""Calibration at a source of known place: the fit of all its readings, and repeats that locate it from a few measurements each (Type B)."""

from dataclasses import dataclass, replace

import numpy as np

from oio.core.errors import NotObservable
from oio.core.records import Array
from oio.gas.range_law import RangeLaw
from oio.gas.timing import Delay
from oio.gas.trace import Sniffs
from oio.inference.base import Localizer
from oio.inference.beacon_fit import beacon_problem, fit_beacon
from oio.inference.delay_fit import fit_delay
from oio.inference.forward_model import Problem
from oio.inference.map_fit import Fit
from oio.inference.metrics import nees
from oio.inference.prior import Nominal, calibrated_prior
from oio.inference.process_noise import ProcessNoise
from oio.inference.range_spheres import range_spheres
from oio.inference.trilateration import vertex
from oio.inference.uncertainty import Noise, TypeB, type_b_of_repeats
from oio.inference.world_posterior import widened
from oio.kinematics.arm import Arm


@dataclass(frozen=True)
class Repeat:
    """One repeat of trilateration of the known source: Voronoi vertex of the spheres, refined position, and its covariance."""

    centres_m: Array  # (k, 3)
    radii_m: Array  # (k,)
    vertex_m: Array | None  # (3,), None if the spheres do not determine one
    refined_m: Array  # (3,)
    refined_cov_m2: Array  # (3, 3)
    miss_m: float
    nees: float
    moves: int  # until one place was left, or as many as were made


def type_b(repeats: tuple[Repeat, ...]) -> TypeB:
    """Type B uncertainty of repeats."""
    misses, nees, traces = (
        np.array(values) for values in zip(*((r.miss_m, r.nees, np.trace(r.refined_cov_m2)) for r in repeats), strict=True)
    )
    return type_b_of_repeats(misses, nees, tuple(r.moves for r in repeats), traces)


@dataclass(frozen=True, eq=False)
class BeaconSurvey:
    """What is known before the fit: arm, nominal law and sensor, the beacon's place (3,) [m] with its standard uncertainty per axis [m],
    the elements' offsets (E,) [ppm] with theirs, and the noise over that of the data sheet."""

    arm: Arm
    range_law: RangeLaw
    process_noise: ProcessNoise
    belief_map: Localizer
    nominal: Nominal
    place: tuple[Array, float]
    offsets: tuple[Array, Array]
    noise_scale: float

    def problem(self, sniffs: Sniffs) -> Problem:
        """Fit problem of a trace at the beacon."""
        return beacon_problem(sniffs, self.arm, self.range_law, self.nominal, self.offsets, self.place)

    def delay(self, sniffs: Sniffs) -> Delay:
        """How late readings are stamped: as told, or as the beacon's readings say."""
        told, scale = Delay(self.nominal.delay_s, self.nominal.delay_u_s), self.noise_scale
        return fit_delay(self.problem(sniffs), told, lambda problem: fit_beacon(problem, scale)) if told.u_s else told

    def fit(self, sniffs: Sniffs, like: Fit | None = None) -> Fit:
        """Fit of a trace whose delay is taken off; `like`: start and form from an earlier fit."""
        return fit_beacon(self.problem(sniffs), self.noise_scale, like)

    def repeat(self, sniffs: Sniffs, ends_s: list[float], least: int, fit: Fit) -> Repeat:
        """One trilateration, which began at the first of `ends_s`: of as many measurements as a repeat has (`least`), and, while their
        map leaves several places, of the next ones too, up to as many again. One joint or two always leave an inverse point."""
        for made in range(least, min(2 * least, len(ends_s) - 1) + 1):
            found, law = self._locate(sniffs, (ends_s[0], ends_s[made]), fit)
            if len(found) == 1 or self.arm.dof < 3:
                break
        refined = widened(found[0], found[1:])
        own = sniffs.between(ends_s[0], ends_s[made])
        centres, radii = range_spheres(own, law, self.arm, self.range_law, made)
        try:
            point = vertex(centres, radii)
        except NotObservable:
            point = None
        miss, cov = refined.source - self.place[0], refined.source_cov
        return Repeat(centres, radii, point, refined.source, cov, float(np.linalg.norm(miss)), nees(miss, cov), made - 1)

    def _locate(self, sniffs: Sniffs, span: tuple[float, float], fit: Fit) -> tuple[tuple[Fit, ...], Fit]:
        """Places of the source by the readings of a span, best first, and the law, which is fitted without them."""
        law = self.fit(sniffs.without(*span), fit)
        told_nothing = replace(law, law=law.law.with_unknown_strength())  # a strength that was told is another source's
        known = calibrated_prior(told_nothing, self.arm, self.process_noise, self.nominal, Noise.nominal())
        return self.belief_map.as_calibrated.locate(sniffs.between(*span), known), law
