"""PASS, WARN or FAIL with reasons: each says the number, the limit, and what to do."""

from dataclasses import dataclass

from oio.settings import settings


@settings
class Limits:
    """When a run is good. A criterion that misses its limit warns; coverage and a lost search fail."""

    nis_low: float
    nis_high: float
    baseline_effective: float  # independent readings of an element's baseline
    bound_ratio: float  # source error over the Cramer-Rao bound


@dataclass(frozen=True, slots=True)
class Verdict:
    """The overall word and the reasons for it."""

    word: str
    reasons: tuple[str, ...]


def judge(warnings: list[str], failures: list[str]) -> Verdict:
    """FAIL if anything failed, WARN if anything warned."""
    word = "FAIL" if failures else "WARN" if warnings else "PASS"
    return Verdict(word, (*failures, *warnings))
