"""Jobs on a Dask cluster: one that runs already, or one made on this machine. Workers share no folder with it; results come as bytes."""

import importlib
import logging
import queue
import shutil
import signal
import socket
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from oio.cli.run_folder import LOG_IS_AT, STATUS, write_status
from oio.core import interrupt
from oio.core.errors import OioError
from oio.sweep.engine import STOP_S, Ended
from oio.sweep.fingerprint import folders_of, version_of_everything
from oio.sweep.manifest import Job
from oio.sweep.worker import Work, run_job

CONNECT_S = 10.0
LOG = "run.mcap"


@dataclass(frozen=True)
class Collected:
    """What a worker sends back: how the job ended, its files, and where the others lie (None if there are none)."""

    state: str
    error: str | None
    files: dict[str, bytes]
    left_at: str | None


@dataclass(frozen=True)
class DaskCluster:
    """Jobs by Dask's scheduler, which balances them and tries those of a dead worker again."""

    address: str | None
    workers: int
    memory_limit: str
    retries: int
    collect: str

    def run(self, works: Sequence[Work]) -> Iterator[Ended]:
        """See `oio.sweep.engine.Engine`."""
        if not works:
            return
        version = version_of_everything(folders_of(works[0].places))
        with self._client() as client:
            ended: queue.Queue[Any] = queue.Queue()
            told = {"places": works[0].places, "version": version, "collect": self.collect}
            made = client.map(run_elsewhere, [work.job for work in works], **told, pure=False)
            futures = {future.key: (future, work) for future, work in zip(made, works, strict=True)}
            for future in made:
                future.add_done_callback(ended.put)
            try:
                while futures:
                    interrupt.check()
                    try:
                        key = ended.get(timeout=0.2).key
                    except queue.Empty:
                        continue
                    future, work = futures.pop(key)
                    yield work, *_received(future, work)
            finally:
                client.cancel([future for future, _ in futures.values()], force=True)

    @contextmanager
    def _client(self) -> Iterator[Any]:
        distributed = importlib.import_module("distributed")
        logging.getLogger("distributed").setLevel(logging.CRITICAL)
        importlib.import_module("dask").config.set({"distributed.scheduler.allowed-failures": self.retries})
        if self.address is not None:
            try:
                client = distributed.Client(self.address, timeout=CONNECT_S)
            except (OSError, ValueError) as error:
                given = f"hydra.launcher.address={self.address} was given, but no scheduler answers there within {CONNECT_S:.0f} s"
                start = "Start one: dask scheduler; and on every machine: dask worker ADDRESS"
                raise OioError(f"{given} ({type(error).__name__}). {start}.") from None
            with client:
                yield _told(client)
            return
        with _ctrl_c_ignored():
            made = distributed.LocalCluster(
                n_workers=self.workers, threads_per_worker=1, memory_limit=self.memory_limit, host="127.0.0.1",
                dashboard_address="127.0.0.1:0", silence_logs=logging.CRITICAL,
            )  # fmt: skip
        try:
            with distributed.Client(made) as client:
                yield _told(client)
        finally:
            _close(made)


def _close(made: Any) -> None:
    """Close a cluster of this machine. Workers at a job would end it first, for minutes: they are killed, and Dask starts none anew."""
    psutil = importlib.import_module("psutil")
    with suppress(TimeoutError):
        made.close(timeout=STOP_S / 2)
    for child in psutil.Process().children(recursive=True):
        with suppress(psutil.NoSuchProcess):  # it may have ended by now, or be a zombie
            if "spawn_main" in " ".join(child.cmdline()):
                child.kill()
    made.shutdown_on_close = False  # else it would be closed once more at exit, for ten seconds


@contextmanager
def _ctrl_c_ignored() -> Iterator[None]:
    """Processes that begin meanwhile ignore Ctrl-C, which a terminal sends to all of a group: the parent decides when they end."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _told(client: Any) -> Any:
    sys.stderr.write(f"Dask dashboard: {client.dashboard_link}\n")
    return client


def run_elsewhere(job: Job, places: tuple[str, ...], version: str, collect: str) -> Collected:
    """Run a job in a folder of the worker's own, and return its files; of another version of the code nothing is run."""
    here = version_of_everything(folders_of(places))
    if here != version:
        told = f"the worker on {socket.gethostname()} has another version of the code, configuration or packages ({here}, here {version})"
        return Collected("failed", f"{told}. Install the same there.", {}, None)
    folder = Path(tempfile.mkdtemp(prefix="oio_job_"))
    out = folder / "run"
    state, error = run_job(Work(job, out, places))
    kept = [path for path in sorted(out.glob("*")) if collect == "summary" and path.name.startswith(LOG)]
    files = {path.name: path.read_bytes() for path in sorted(out.glob("*")) if path not in kept}
    if not kept:
        shutil.rmtree(folder)
    return Collected(state, error, files, f"{socket.gethostname()}:{out}" if kept else None)


def _received(future: Any, work: Work) -> tuple[str, str | None]:
    """Write what came back into the job's folder, status.json last, and return state and error."""
    try:
        got: Collected = future.result()
    except Exception as error:  # whatever the cluster raises; an exception of the job itself is among what it returns
        return "killed", f"its worker died, or the cluster lost it: {type(error).__name__}: {error}"
    work.out.mkdir(parents=True, exist_ok=True)
    files = dict(got.files)
    if got.left_at is not None:
        files[LOG_IS_AT] = f"{got.left_at}\n".encode()
    for name, data in sorted(files.items(), key=lambda item: item[0] == STATUS):
        (work.out / Path(name).name).write_bytes(data)
    if STATUS not in files:
        write_status(work.out, got.state, got.error)
    return got.state, got.error
