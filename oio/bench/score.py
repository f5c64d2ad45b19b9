"""Score of one trial: a row of trials.csv. Lengths in mm."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from scipy.special import chdtri

NEES_95 = float(chdtri(3, 0.05))  # end of the 95 % region of a position
NEES_3_SIGMA = float(chdtri(3, 2.7e-3))  # 14.2, end of the three-sigma region (99.73 %) of a position


class Case(NamedTuple):
    """Configuration shared by trials that differ in seed only."""

    sensor: str
    air: str
    dof: int
    search: str
    ekf: str
    world: str = "unchanged"

    @property
    def words(self) -> tuple[str, ...]:
        """Return the case as overrides of the configuration."""
        return tuple(f"{key}={value}" for key, value in self._asdict().items())


@dataclass(frozen=True, slots=True)
class Score:
    """Score of one completed trial."""

    error_mm: float
    nees: float
    inside_95: bool  # the source is in the 95 % region of the best place
    in_region: bool  # or in that of another place that is left: the region is that of all of them
    bound_mm: float
    declared: bool
    false: bool  # false declaration: declared, but far from the source
    moves: int
    time_s: float  # of the search, until the source was declared or the search given up
    nis: float
    nose_mm: float  # RMS
    dead_reckoning_mm: float
    cold_error_mm: float  # nominal values taken as known
    cold_open_error_mm: float  # as open as where the fit on the beacon begins
    calibration_s: float
    error_ppm: float
    u_a_ppm: float
    u_b_mm: float
    filter_mm: float  # source error of the filter alone, before the last map: it differs between filters
    filter_nees: float
    assumed_world: str  # by the best hypothesis of the last map
    wrong: bool  # the source is far from the answer, or outside its three-sigma region
    passed: bool  # the verdict, which does not see the truth, is PASS


@dataclass(frozen=True, slots=True)
class Trial:
    """A case with a seed, and its score or the reason of its failure."""

    case: Case
    seed: int
    score: Score | None
    reason: str


def scored(case: Case, seed: int, document: Mapping[str, Any] | None, reason: str, false_mm: float) -> Trial:
    """Return the scored trial from the summary of a run; a run that ended without a belief has failed."""
    if document is None:
        return Trial(case, seed, None, reason)
    if document["calibrated"]["source_error_m"] is None or document["cold"]["source_error_m"] is None:
        return Trial(case, seed, None, "the search ended before its first belief map: raise stage.navigate.max_s")
    return Trial(case, seed, _score(document, false_mm), "")


def _score(document: Mapping[str, Any], false_mm: float) -> Score:
    o, calibration = document["calibrated"], document["calibration"]
    error_mm = 1e3 * o["source_error_m"]
    return Score(
        error_mm=error_mm, nees=o["nees_source"], inside_95=o["inside_95"], in_region=o["inside_95"] or _elsewhere(o),
        bound_mm=_mm(document["bound_m"]),
        declared=o["found"], false=o["found"] and error_mm > false_mm, moves=o["moves"], time_s=o["time_s"],
        nis=math.nan if o["nis_mean"] is None else o["nis_mean"], nose_mm=_mm(o["nose_error_m"]),
        dead_reckoning_mm=_mm(document["dead_reckoning"]["nose_error_m"]), cold_error_mm=1e3 * document["cold"]["source_error_m"],
        cold_open_error_mm=_mm(document["cold_open"]["source_error_m"]),
        calibration_s=calibration["time_s"], error_ppm=calibration["error_ppm"], u_a_ppm=calibration["u_a_ppm"],
        u_b_mm=_mm(calibration["u_b_m"]), filter_mm=_mm(o["filtered_error_m"]),
        filter_nees=math.nan if o["filtered_nees"] is None else o["filtered_nees"],
        assumed_world=o["world"], wrong=error_mm > false_mm or o["nees_source"] > NEES_3_SIGMA, passed=document["verdict"] == "PASS",
    )  # fmt: skip


def _elsewhere(outcome: Mapping[str, Any]) -> bool:
    return any(place["nees_source"] <= NEES_95 for place in outcome["other_places"])


def _mm(value_m: float | None) -> float:
    return math.nan if value_m is None else 1e3 * value_m
