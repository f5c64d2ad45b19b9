"""Jobs of a sweep, in whatever process: composed, built and run into their own folders."""

import json
import threading
import traceback
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from oio.cli.build import build
from oio.cli.compose import compose
from oio.cli.execute import execute
from oio.cli.hydra_errors import known_error
from oio.cli.input_files import input_files
from oio.cli.run_folder import state_of, write_status
from oio.cli.shared_stages import SharedStages
from oio.core import interrupt
from oio.core.folders import CONF
from oio.sweep.manifest import INPUTS, Job

ONE_AT_A_TIME = threading.Lock()  # Hydra's state is global, and a worker of a cluster may have several threads


@dataclass(frozen=True, slots=True)
class Work:
    """A job as a worker needs it: where it writes, and the further folders on Hydra's search path."""

    job: Job
    out: Path
    places: tuple[str, ...] = ()


def run_bundle(works: Sequence[Work]) -> list[tuple[str, str | None]]:
    """Run jobs one after another, those that begin with the same stages from where they part; return the state and error of each."""
    shared = SharedStages() if len(works) > 1 else None
    return [run_job(work, shared) for work in works]


def run_job(work: Work, shared: SharedStages | None = None) -> tuple[str, str | None]:
    """Run a job into its folder, and return its state and error; nothing is raised, so that a failure does not stop the others."""
    try:
        interrupt.check()
        with ONE_AT_A_TIME:
            composed = compose(work.job.words, work.places)
            experiment = build(composed.cfg, composed.choices, list(work.job.words))
            inputs = input_files(composed.cfg)
        notes = {INPUTS: json.dumps(inputs, indent=1) + "\n"} if inputs else {}
        execute(experiment, work.out, quiet=True, notes=notes, shared=shared)
    except KeyboardInterrupt:
        return "interrupted", None
    except Exception as error:
        return _failure(work.out, error)
    return "done", None


def _failure(out: Path, error: Exception) -> tuple[str, str]:
    """Return `failed` and the error, written to status.json unless the run itself has written it."""
    text = str(known_error(error, CONF) or repr(error))
    if state_of(out)[0] == "missing":
        out.mkdir(parents=True, exist_ok=True)
        write_status(out, "failed", text, "".join(traceback.format_exception(error)))
    return "failed", text
