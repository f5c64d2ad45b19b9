"""What became of a run below Hydra, which returns nothing and would print an exception twice: noted here, taken up when Hydra is done."""

from collections.abc import Callable
from pathlib import Path

FAILED: list[Exception] = []
VERDICTS: list[str] = []
TO_SHOW: list[Callable[[], None]] = []  # what prints the outcome of a run
TO_REPORT: list[Path] = []  # folders of runs that are done and want a report


def raise_first() -> None:
    """Raise the first error noted, if there is one, and forget them all."""
    noted = list(FAILED)
    FAILED.clear()
    if noted:
        raise noted[0]


def show_all() -> None:
    """Print the outcomes noted, and forget them."""
    noted = list(TO_SHOW)
    TO_SHOW.clear()
    for show in noted:
        show()


def verdict_failed() -> bool:
    """Whether the verdict of a run was FAIL; forgets them all."""
    failed = "FAIL" in VERDICTS
    VERDICTS.clear()
    return failed
