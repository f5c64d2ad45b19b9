"""Several trials of one experiment as one job: whole runs in memory, with seeds that count up, and one summary of them all."""

import tempfile
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from oio.cli.build import reseeded
from oio.cli.count_progress import CountProgress
from oio.cli.csv_file import CsvFile
from oio.cli.experiment import Experiment
from oio.cli.hydra_errors import known_error
from oio.cli.reproducible import reproducible
from oio.core import interrupt
from oio.core.errors import OioError
from oio.core.folders import CONF
from oio.log import MemoryLog
from oio.results.calibration import Calibration
from oio.results.evaluation import Evaluation
from oio.results.summary import summary
from oio.results.trials_summary import OUTCOMES, summary_of_trials
from oio.results.verdict import judge
from oio.runtime.runner import run_stages

TABLE = "trials.csv"
OF_AN_OUTCOME = ("source_error_m", "bearing_error_deg", "sd_m", "nees_source", "inside_95", "moves", "time_s", "found", "world")
OF_A_CALIBRATION = ("time_s", "error_ppm", "u_a_ppm", "u_b_m", "moves")
COLUMNS = (
    "seed", "verdict", "scored", "bound_m", *(f"calibration.{key}" for key in OF_A_CALIBRATION),
    *(f"{outcome}.{key}" for outcome in OUTCOMES for key in OF_AN_OUTCOME), "failed",
)  # fmt: skip


def run_trials(experiment: Experiment, out: Path, quiet: bool) -> dict[str, Any]:
    """Run the trials, one row of trials.csv in `out` after the other, and return the summary of all. A trial that fails stops no other.

    Raises KeyboardInterrupt for a stop, and OioError if every trial failed.
    """
    began, seeds = time.monotonic(), [experiment.seed + i for i in range(experiment.trials)]
    documents, failed = list[dict[str, Any]](), dict[int, str]()
    sheet = CsvFile(out / TABLE, COLUMNS)
    try:
        with CountProgress(len(seeds), "trials", quiet) as progress:
            for seed in seeds:
                try:
                    document = run_in_memory(reseeded(experiment, seed))
                except Exception as error:
                    interrupt.check()  # a stop within compiled code looks like a defect of it
                    failed[seed] = str(known_error(error, CONF) or repr(error))
                    sheet.add({"seed": seed, "failed": failed[seed]})
                else:
                    documents.append(document)
                    sheet.add(_row(document))
                progress.ended("failed" if seed in failed else "done")
    except KeyboardInterrupt:
        done = len(documents) + len(failed)
        raise KeyboardInterrupt(f"stopped; {done} of {len(seeds)} trials have ended, and stand in {out / TABLE}") from None
    finally:
        sheet.close()
    if not documents:
        raise OioError(f"all {len(seeds)} trials failed. The first: {failed[seeds[0]]}")
    judged = reproducible({})
    told = {"reproducible": {"word": judged.word, "reasons": list(judged.reasons)}, "wall_s": round(time.monotonic() - began, 3)}
    return {**summary_of_trials(experiment.identity, documents, seeds, failed), **told}


def run_in_memory(experiment: Experiment) -> dict[str, Any]:
    """Return the summary of one run that leaves no file; its wall-clock time is 0."""
    with tempfile.TemporaryDirectory() as folder, experiment.backend.open() as world:
        log, highest = MemoryLog(), experiment.sensor.highest_raw
        results = run_stages(experiment.stages, world, experiment.arm, log, Path(folder), experiment.seed, highest)
    calibration, found = results.get(Calibration), results.get(Evaluation)
    assert calibration is None or isinstance(calibration, Calibration)
    assert found is None or isinstance(found, Evaluation)
    return summary(experiment.identity, calibration, found, judge(results, experiment.verdict), 0.0)


def _row(document: Mapping[str, Any]) -> dict[str, Any]:
    scored, calibration = document["scored"], document["calibration"] or {}
    outcomes = ((f"{outcome}.{key}", (document.get(outcome) or {}).get(key)) for outcome in OUTCOMES for key in OF_AN_OUTCOME)
    return {
        "seed": document["seed"], "verdict": document["verdict"], "scored": scored["word"] if scored else None,
        "bound_m": document["bound_m"], **{f"calibration.{key}": calibration.get(key) for key in OF_A_CALIBRATION}, **dict(outcomes),
    }  # fmt: skip
