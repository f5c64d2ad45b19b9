"""The jobs of a sweep to look at first: what failed, what was sure and wrong, what was far off."""

from collections.abc import Sequence

from oio.sweep.records import Record, error_of


def worst(rows: Sequence[Record], count: int) -> list[tuple[Record, str]]:
    """Return up to `count` records with the reason, the most alarming first; those that are merely good are not among them."""
    told = [(row, *_alarm(row)) for row in rows]
    ranked = sorted((entry for entry in told if entry[1] < len(REASONS)), key=lambda entry: (entry[1], -(error_of(entry[0]) or 0.0)))
    return [(row, reason) for row, _, reason in ranked[:count]]


REASONS = ("not done", "declared, and the source is elsewhere", "PASS, and the source is elsewhere", "wrong, not declared", "far off")
FAR_M, FAR_DEG = 0.05, 15.0


def _alarm(row: Record) -> tuple[int, str]:
    """The place of the reason in `REASONS`, and its text."""
    wrong = row.get("scored.word") == "WRONG"
    error = error_of(row) or 0.0
    far = error > (FAR_M if row.get("calibrated.source_error_m") is not None else FAR_DEG)
    checks = (row["state"] != "done", wrong and row.get("calibrated.found"), wrong and row.get("verdict") == "PASS", wrong, far)
    place = next((i for i, holds in enumerate(checks) if holds), len(REASONS))
    return place, f"{REASONS[0]}: {row['state']}" if place == 0 else REASONS[place] if place < len(REASONS) else ""
