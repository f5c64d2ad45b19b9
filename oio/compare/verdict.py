"""The verdict on a comparison of calibrations, in sentences."""

from collections.abc import Sequence

from oio.compare.comparison import Comparison, Row

SHOWN = 3  # differences that a sentence names


def verdict(found: Comparison) -> str:
    """Return one sentence that begins with `agree` or `differ`, and one more on sections that were not judged."""
    return " ".join([_judged(found), *_elsewhere(found)])


def _judged(found: Comparison) -> str:
    if found.agree:
        return f"agree within their uncertainty ({' and '.join(found.judged)})."
    reasons = [*found.facts[:SHOWN], *_named(found.flagged, len(found.names))]
    reasons = reasons or [f"all together, chi-square {found.chi2:.1f} of {found.dof}, though no quantity by itself"]
    return f"differ: {'; '.join(reasons)}. Calibrate again, or find what changed."


def _elsewhere(found: Comparison) -> list[str]:
    reasons = [*found.remarks, *_named(found.elsewhere, len(found.names))]
    if not reasons:
        return []
    only_air = all(row.key.startswith("range_law.") for row in found.elsewhere)
    return [f"Not judged: {'; '.join(reasons)}{', as the air of another hour may' if only_air else ''}."]


def _named(rows: Sequence[Row], calibrations: int) -> list[str]:
    named = [f"{row.key} by {abs(row.sd):.1f} sd" if calibrations == 2 else f"{row.key} by chi-square {_chi2(row)}" for row in rows[:SHOWN]]
    return [*named, f"{len(rows) - SHOWN} more"] if len(rows) > SHOWN else named


def _chi2(row: Row) -> str:
    return f"{row.test.chi2:.1f} of {row.test.dof}" if row.test is not None else "0"
