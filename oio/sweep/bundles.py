"""Jobs that begin alike, such as several filters over one truth, go to one process, one after another: it simulates the beginning once."""

from collections.abc import Sequence

from oio.sweep.worker import Work

LATE = ("ekf", "search", "stop", "stage.navigate", "stage.evaluate")  # keys, or what they begin with, that no calibration depends on

MOST = 8  # jobs of a bundle: they are told as one, and what one has in common with more is a small part of them


def bundles(works: Sequence[Work], processes: int) -> list[list[Work]]:
    """Return the jobs in bundles that differ in LATE keys alone, in the order of their first jobs, and at least one for each process.

    Whether they have stages in common is found out by `oio.cli.shared_stages`; here it is only made possible.
    """
    groups: dict[tuple[str, ...], list[Work]] = {}
    for work in works:
        groups.setdefault(tuple(word for word in work.job.key if not _is_late(word)), []).append(work)
    most = min(max(-(-len(works) // max(processes, 1)), 1), MOST)
    return [group[i : i + most] for group in groups.values() for i in range(0, len(group), most)]


def _is_late(word: str) -> bool:
    key = word.lstrip("+~").partition("=")[0]
    return any(key == late or key.startswith(f"{late}.") for late in LATE)
