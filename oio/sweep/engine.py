"""Where jobs run: one after another in this process, or in worker processes. A killed worker costs its job a retry, not the sweep."""

import itertools
import os
import signal
import threading
import time
from collections import Counter, deque
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from dataclasses import dataclass
from typing import Protocol

from joblib.externals.loky.process_executor import ProcessPoolExecutor

from oio.cli.run_folder import STOPPED, state_of, write_status
from oio.cli.shared_stages import SharedStages
from oio.core import interrupt
from oio.sweep.attempts import set_aside
from oio.sweep.bundles import bundles
from oio.sweep.worker import Work, run_bundle, run_job

Bundled = Future[list[tuple[str, str | None]]]
Ended = tuple[Work, str, str | None]  # the job, its state and error
AHEAD = 3  # bundles handed out per worker, so that none waits for the next
STOP_S = 2.0  # for workers to close their logs after a stop; then they are killed


class Engine(Protocol):
    """What runs jobs."""

    def run(self, works: Sequence[Work]) -> Iterator[Ended]:
        """Yield jobs as they end, in any order; KeyboardInterrupt passes after the jobs have been stopped."""
        ...


@dataclass(frozen=True)
class InThisProcess:
    """One job after another."""

    def run(self, works: Sequence[Work]) -> Iterator[Ended]:
        """See `Engine`."""
        for bundle in bundles(works, 1):
            shared = SharedStages() if len(bundle) > 1 else None
            for work in bundle:
                state, error = run_job(work, shared)
                interrupt.check()
                yield work, state, error


@dataclass(frozen=True)
class WorkerProcesses:
    """So many jobs at a time, in processes that take one after another; a job whose process dies is tried again."""

    processes: int
    retries: int = 2

    def run(self, works: Sequence[Work]) -> Iterator[Ended]:
        """See `Engine`."""
        tries: Counter[Work] = Counter()
        waiting = list(works)
        while waiting:
            lost: list[Work] = []
            yield from self._until_one_dies(waiting, lost)
            for work, state, error in [(work, *state_of(work.out)) for work in lost]:
                if state in ("done", "failed"):  # its process died after its last word, or with another's
                    lost.remove(work)
                    yield work, state, error
            begun = [work for work in lost if state_of(work.out)[0] == "killed"]
            tries.update(begun)
            given_up = [work for work in begun if tries[work] > self.retries]
            for work in given_up:
                yield work, "killed", f"its worker process died {tries[work]} times; too little memory?"
            waiting = [work for work in lost if work not in given_up]
            for work in waiting:
                set_aside(work.out)

    def _until_one_dies(self, works: Sequence[Work], lost: list[Work]) -> Iterator[Ended]:
        """Yield what ends; `lost` are the jobs that had not when a worker died, which ends the others as well."""
        pool = ProcessPoolExecutor(max_workers=min(self.processes, len(works)), initializer=_begin_worker, initargs=(os.getpid(),))
        left, running = deque(bundles(works, self.processes)), dict[Bundled, list[Work]]()
        try:
            while (left and not lost) or running:
                while left and not lost and len(running) < AHEAD * self.processes:
                    bundle = left.popleft()
                    running[pool.submit(run_bundle, bundle)] = bundle
                done, _ = wait(running, timeout=0.2, return_when=FIRST_COMPLETED)
                interrupt.check()
                for future in done:
                    bundle = running.pop(future)
                    try:
                        ended = future.result()
                    except BrokenProcessPool:
                        lost += bundle
                    else:
                        yield from ((work, *end) for work, end in zip(bundle, ended, strict=True))
        finally:
            _stop(pool, running)
        lost += itertools.chain.from_iterable(left)


def _stop(pool: ProcessPoolExecutor, running: dict[Bundled, list[Work]]) -> None:
    """End the workers: those at work close their logs first, if they can within `STOP_S`, then they are killed."""
    workers = list(pool._processes.values())
    left = [future for future in running if not future.cancel()]
    if left:
        for worker in workers:
            worker.terminate()
        wait(left, timeout=STOP_S)
        for worker in workers:
            with suppress(ProcessLookupError):
                os.kill(worker.pid, signal.SIGKILL)
    pool.shutdown(wait=True, kill_workers=bool(left))
    for work in itertools.chain.from_iterable(running.values()):
        if state_of(work.out)[0] == "killed":
            write_status(work.out, "interrupted", STOPPED)


def _begin_worker(parent: int) -> None:
    interrupt.note_only()
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


def _end_with(parent: int) -> None:
    """End this process when its parent has gone, so that no job goes on after a sweep was killed."""
    while os.getppid() == parent:
        time.sleep(0.5)
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(STOP_S)
    os._exit(1)
