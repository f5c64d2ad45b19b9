"""Summary of several trials of one configuration, which differ in their seeds: medians and shares in the places of one run's numbers, and
how they are distributed."""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from oio.core.records import Array
from oio.results.criteria.judgement import PASS, WORDS
from oio.results.statistics import anees_band, wilson

OUTCOMES = ("cold", "cold_open", "calibrated", "calibrated_paper_assembly")
WRONG = "WRONG"  # of `Scored`
Document = Mapping[str, Any]


def summary_of_trials(identity: Document, documents: Sequence[Document], seeds: Sequence[int], failed: Mapping[int, str]) -> dict[str, Any]:
    """Return a document with the keys of a summary: of the documents (at least one), a number is the median, yes or no the share of yes, a
    word the most frequent one, a list nothing; `verdict` is the word of most trials, the worse one of two. `distribution` has the rest.

    `failed`: the reasons of the trials that failed, by seed.
    """
    verdicts = _counts([document["verdict"] for document in documents])
    return {
        **_typical(documents),
        **identity,
        "verdict": max(reversed(WORDS), key=lambda word: verdicts.get(word, 0)),
        "verdicts": {},
        "reasons": [f"{len(documents)} trials: {_told(verdicts)}."],
        "criteria": [],
        "scored": {"word": "unknown", "reasons": []},
        "distribution": {
            "trials": len(seeds),
            "first_seed": seeds[0],
            "failed": {str(seed): reason for seed, reason in failed.items()},
            "outcomes": {key: _outcomes([d[key] for d in documents]) for key in OUTCOMES if all(d.get(key) for d in documents)},
            "verdicts": verdicts,
            "scored": _counts([document["scored"]["word"] for document in documents if document["scored"]]),
            "pass_but_wrong": sum(d["verdict"] == PASS and bool(d["scored"]) and d["scored"]["word"] == WRONG for d in documents),
            "criteria": _criteria(documents),
        },
    }


def _counts(words: Sequence[str]) -> dict[str, int]:
    return {word: count for word, count in sorted(Counter(words).items())}


def _told(counts: Mapping[str, int]) -> str:
    return ", ".join(f"{counts[word]} {word}" for word in WORDS if word in counts)


def _criteria(documents: Sequence[Document]) -> dict[str, dict[str, int]]:
    """How often each criterion of the verdict gave each word."""
    given: dict[str, list[str]] = {}
    for document in documents:
        for judgement in document["criteria"]:
            given.setdefault(judgement["name"], []).append(judgement["word"])
    return {name: _counts(words) for name, words in given.items()}


def _outcomes(outcomes: Sequence[Document]) -> dict[str, Any]:
    """Distribution of one outcome over the trials: errors in m, or in degrees where the joints observe a bearing alone."""
    bearing = all(outcome.get("bearing_error_deg") is not None for outcome in outcomes)
    errors = _numbers(outcomes, "bearing_error_deg" if bearing else "source_error_m")
    nees = _numbers(outcomes, "nees_source")
    return {
        "bearing_error_deg" if bearing else "source_error_m": _quantiles(errors),
        "in_95": _share([o["inside_95"] for o in outcomes if o["inside_95"] is not None]),
        "declared": _share([o["found"] for o in outcomes]),
        "anees": _anees(nees) if len(nees) and not bearing else None,
    }


def _numbers(outcomes: Sequence[Document], key: str) -> Array:
    return np.array([o[key] for o in outcomes if o.get(key) is not None and np.isfinite(o[key])], dtype=float)


def _quantiles(values: Array) -> dict[str, float] | None:
    if not len(values):
        return None
    median, p90, p95 = np.quantile(values, (0.5, 0.9, 0.95))
    return {"median": float(median), "p90": float(p90), "p95": float(p95), "worst": float(np.max(values))}


def _share(found: Sequence[bool]) -> dict[str, float] | None:
    """Count, share and its 95 % interval (Wilson)."""
    if not found:
        return None
    low, high = wilson(sum(found), len(found))
    return {"count": sum(found), "of": len(found), "share": sum(found) / len(found), "low": low, "high": high}


def _anees(nees: Array) -> dict[str, float]:
    """Mean NEES over its dimension, 1 if the filter is consistent, and the band in which 95 % of such means lie then."""
    low, high = anees_band(len(nees))
    return {"value": float(np.mean(nees)) / 3.0, "low": low, "high": high}


def _typical(values: Sequence[Any]) -> Any:
    """A mapping of the same keys; the median of numbers, the share of yes, the most frequent word; None for a list, or where all are."""
    there = [value for value in values if value is not None]
    if not there or isinstance(there[0], list | tuple):
        return None
    if isinstance(there[0], Mapping):
        keys = dict.fromkeys(key for value in there for key in value)
        return {key: _typical([value.get(key) for value in there]) for key in keys}
    if isinstance(there[0], str):
        return Counter(there).most_common(1)[0][0]
    if isinstance(there[0], bool):
        return sum(there) / len(there)
    finite = [value for value in there if np.isfinite(value)]
    return float(np.median(finite)) if finite else None
