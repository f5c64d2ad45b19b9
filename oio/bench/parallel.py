"""Parallel execution of trials in worker processes, results in order of completion, with a progress bar. Ctrl-C ends the workers."""

import signal
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from joblib import Parallel, delayed, parallel_config
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from oio.cli import terminal
from oio.cli.first_compile import first_compile


def run_parallel(
    work: Callable[..., Any], tasks: Sequence[tuple[Any, ...]], jobs: int, what: str, at_a_time: int = 1
) -> Iterator[tuple[int, Any]]:
    """Yield (task number, work(*task)) in any order; `at_a_time` tasks per batch, one linear-algebra thread per worker."""
    first_compile()  # or every worker would
    columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TimeRemainingColumn()
    bar = Progress(*columns, console=terminal.console(stderr=True), disable=not terminal.may_move())
    with bar, parallel_config(backend="loky", n_jobs=jobs, inner_max_num_threads=1, initializer=_ignore_sigint):
        numbered = (delayed(_numbered)(work, i, task) for i, task in enumerate(tasks))
        results = Parallel(return_as="generator_unordered", batch_size=at_a_time, pre_dispatch="2*n_jobs")(numbered)
        try:
            yield from bar.track(results, total=len(tasks), description=what)
        finally:
            results.close()  # ends the workers if not all is done


def _numbered(work: Callable[..., Any], number: int, task: tuple[Any, ...]) -> tuple[int, Any]:
    return number, work(*task)


def _ignore_sigint() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
