"""Two elements on the board: at one place or at two, read in turn or together; and what each board gains over the first, in pairs."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from oio.bench.score import Case, Score
from oio.core.records import Array
from oio.results.statistics import wilson
from oio.sweep.bootstrap import interval

NAN = float("nan")
PLACES, SAMPLING = ("one", "two"), ("in_turn", "together")
BOARDS = tuple(f"{places}_{sampling}" for places in PLACES for sampling in SAMPLING)


class BoardCase(NamedTuple):
    """Configuration shared by trials that differ in seed only."""

    case: Case
    board: str

    def words(self, spacing_m: float) -> tuple[str, ...]:
        """Return the case as overrides of the configuration."""
        places, _, sampling = self.board.partition("_")
        apart_m = spacing_m if places == "two" else 0.0
        return (*self.case.words, f"arm.element_spacing_m={apart_m:g}", f"backend.sampling={sampling}")


@dataclass(frozen=True, slots=True)
class BoardTrial:
    """A case with a seed, and its score or the reason of its failure."""

    case: BoardCase
    seed: int
    score: Score | None
    reason: str


@dataclass(frozen=True, slots=True)
class Row:
    """Trials of one case; brackets are 95 % intervals: Wilson's of shares, bootstrap of medians and mean differences.

    Differences are in pairs, with the first board under the first search, in the same air and with the same seed.
    """

    trials: int
    failed: int
    found: int  # declared, and not wrong
    found_share: float
    found_low: float
    found_high: float
    false: int  # declared, but wrong
    covered: float  # share of trials whose 95 % region holds the source
    median_mm: float
    median_low_mm: float
    median_high_mm: float
    moves: float  # median
    time_s: float  # median
    pairs: int
    d_found: float
    d_found_low: float
    d_found_high: float
    ratio: float  # geometric mean of the errors' ratio
    ratio_low: float
    ratio_high: float
    d_moves: float  # mean
    d_moves_low: float
    d_moves_high: float


def rows(trials: Sequence[BoardTrial]) -> dict[BoardCase, Row]:
    """Return a row per case, in the order of their first trials; each is compared with the first of its sensor and air."""
    cases = list(dict.fromkeys(trial.case for trial in trials))
    scores = {case: {t.seed: t.score for t in trials if t.case == case} for case in cases}
    firsts = {_room(case): case for case in reversed(cases)}
    return {case: _row(scores[case], scores[firsts[_room(case)]]) for case in cases}


def _room(case: BoardCase) -> Case:
    return case.case._replace(search="any")


def _row(by_seed: dict[int, Score | None], first: dict[int, Score | None]) -> Row:
    scores = [score for score in by_seed.values() if score is not None]
    pairs = [(score, one) for seed, score in by_seed.items() if score is not None and (one := first.get(seed)) is not None]
    n, errors = len(scores), np.array([s.error_mm for s in scores])
    found = sum(_is_found(s) for s in scores)
    low, high = wilson(found, n) if n else (NAN, NAN)
    d_found = _paired(np.array([float(_is_found(a)) - float(_is_found(b)) for a, b in pairs]))
    ratio = np.exp(_paired(np.array([np.log(max(a.error_mm, 1e-6) / max(b.error_mm, 1e-6)) for a, b in pairs])))
    d_moves = _paired(np.array([float(a.moves - b.moves) for a, b in pairs]))
    return Row(
        len(by_seed), len(by_seed) - n, found, found / n if n else NAN, low, high, sum(s.declared and s.wrong for s in scores),
        float(np.mean([s.in_region for s in scores])) if n else NAN,
        *((float(np.median(errors)), *interval(errors, np.median)) if n else (NAN, NAN, NAN)),
        float(np.median([s.moves for s in scores])) if n else NAN, float(np.median([s.time_s for s in scores])) if n else NAN,
        len(pairs), *map(float, (*d_found, *ratio, *d_moves)),
    )  # fmt: skip


def _is_found(score: Score) -> bool:
    return score.declared and not score.wrong


def _paired(differences: Array) -> tuple[float, float, float]:
    """Mean, and its 95 % bootstrap interval over the pairs."""
    return (float(np.mean(differences)), *interval(differences, np.mean)) if len(differences) else (NAN, NAN, NAN)
