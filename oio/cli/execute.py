"""One run: an experiment executed into an output directory with log, config, status and summary."""

import time
import traceback
from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from pathlib import Path
from typing import Any

from oio.cli import terminal
from oio.cli.attendant import performance
from oio.cli.experiment import Experiment
from oio.cli.first_compile import first_compile
from oio.cli.io_errors import FULL, disk_full
from oio.cli.reproducible import devices_of, provenance, reproducible
from oio.cli.run_display import run_display
from oio.cli.run_folder import STOPPED, SUMMARY, RunFolder, refuse_used, write_whole
from oio.cli.shared_stages import SharedStages, opened
from oio.cli.trials import run_trials
from oio.core import interrupt
from oio.core.errors import OioError
from oio.core.interfaces import RealTime, World
from oio.core.records import Event
from oio.kinematics.model_loading import kinematics_mjcf
from oio.log import MemoryLog, RunLog, Watcher
from oio.log.wall_clock import STARTED
from oio.procedure.performance import Performance
from oio.results.calibration import BaselineResult, Calibration
from oio.results.calibration_file import baseline_yaml
from oio.results.criteria.judgement import Verdict
from oio.results.evaluation import Evaluation
from oio.results.summary import Reproducible, summary, to_json
from oio.results.verdict import judge
from oio.runtime.arm_display import setup_of
from oio.runtime.checkpoint import Checkpoint, Keep, resumable
from oio.runtime.guarded_world import made_of
from oio.runtime.runner import check_order, run_stages


def execute(
    experiment: Experiment, out: Path, quiet: bool = False, notes: Mapping[str, str] | None = None, shared: SharedStages | None = None
) -> dict[str, Any]:
    """Run all stages; leaves run.mcap, config.yaml, status.json and summary.json in `out`, and returns the summary.

    `quiet`: without progress in the terminal. `notes`: further files to write, text by name. `shared`: stages of an earlier run that
    need not run again; the results are the same to the last bit.
    Several trials (`Experiment.trials`) leave no log, but trials.csv.
    A failure leaves its traceback in status.json and is raised again. A directory with a status.json is never written to.
    """
    check_order(experiment.stages)
    refuse_used(out)
    first_compile(quiet)
    if experiment.trials > 1:
        with RunFolder(out) as folder, _ended(folder):
            _write(out, experiment, notes)
            document = run_trials(experiment, out, quiet)
            write_whole(out / SUMMARY, to_json(document))
        return document
    panel = run_display(quiet)
    performed = performance(experiment.procedure, quiet, panel.paused)
    shared = None if performed else shared  # what a person did for one run, nobody did for another
    began = time.monotonic()
    keep = shared.keep if shared is not None and resumable(experiment.backend) else None
    begun = None if shared is None else shared.begin(experiment)
    with (
        experiment.view.open() as viewer,
        _said(opened(experiment, begun), quiet) as world,
        RunFolder(out) as folder,  # a refusal leaves no directory behind
        _ended(folder),
        panel as shown,
    ):
        watchers = [watcher for watcher in (viewer, shown) if watcher is not None]
        _write(out, experiment, notes)
        results, verdict = _stages(experiment, world, out, watchers, performed, begun, keep)
        document = _summary(
            _identity(experiment, performed), results, verdict, performed, time.monotonic() - began, reproducible(devices_of(world))
        )
        _keep_baseline(world, _identity(experiment, performed), results, verdict, out / "calibration.yaml")
        write_whole(out / SUMMARY, to_json(document))
    return document


def _write(out: Path, experiment: Experiment, notes: Mapping[str, str] | None) -> None:
    for name, text in {"config.yaml": experiment.config_yaml, **(notes or {})}.items():
        (out / name).write_text(text, encoding="utf-8")


@contextmanager
def _ended(folder: RunFolder) -> Iterator[None]:
    """Write how the block ended to status.json; a stop is raised as KeyboardInterrupt."""
    try:
        yield
    except BaseException as error:
        if isinstance(error, KeyboardInterrupt) or interrupt.asked():
            folder.status("interrupted", STOPPED)
            raise KeyboardInterrupt(*error.args if isinstance(error, KeyboardInterrupt) else ()) from error
        if isinstance(error, OSError) and error.errno in FULL:
            full = disk_full(error, folder.path)
            with suppress(OSError):  # it may not take this either
                folder.status("failed", str(full))
            raise full from error
        folder.status("failed", str(error) if isinstance(error, OioError) else repr(error), traceback.format_exc())
        raise
    folder.status("done")


@contextmanager
def _said(opening: AbstractContextManager[World], quiet: bool) -> Iterator[World]:
    """Open a world and show what it says of itself before it begins, such as what a recording has read off its file."""
    with opening as world:
        for note in () if quiet else getattr(world, "notes", ()):
            terminal.console(stderr=True, soft_wrap=True).print(note, markup=False, highlight=False)
        yield world


def _stages(
    experiment: Experiment, world: World, out: Path, watchers: list[Watcher], performed: Performance | None, begun: Checkpoint | None,
    keep: Keep | None,
) -> tuple[dict[type, object], Verdict]:  # fmt: skip
    """Run the stages and judge them, while the log is open."""
    arm, stages, sensor = experiment.arm, experiment.stages, experiment.sensor
    with _log(experiment, world, out) as log:
        log.watchers += watchers
        if log.draws:
            log.setup(setup_of(arm, experiment.beacon_m))
        results = run_stages(stages, world, arm, log, out, experiment.seed, sensor.highest_raw, begun, keep, performed)
        verdict = judge(results, experiment.verdict)
        log.write(Event(world.t_ns, "verdict", " ".join((f"{verdict.word}.", *verdict.reasons))))
    return results, verdict


def _log(experiment: Experiment, world: World, out: Path) -> AbstractContextManager[RunLog]:
    if not experiment.logged:
        return nullcontext(MemoryLog())
    attachments = {"config.yaml": experiment.config_yaml.encode(), "arm.mjcf": kinematics_mjcf(experiment.arm.path)}
    metadata = {**experiment.about(), **provenance(devices_of(world)), **_time_of_day(experiment, world)}
    names = experiment.arm.names
    return RunLog.create(out / "run.mcap", sensor=experiment.sensor.name, joints=names, metadata=metadata, attachments=attachments)


def _time_of_day(experiment: Experiment, world: World) -> dict[str, str]:
    """When a bench opened; a simulated world has no time of day, and its logs are the same bytes for the same seed."""
    if not (isinstance(experiment.backend, RealTime) and experiment.backend.real_time):
        return {}
    began_utc = getattr(world, "began_utc", None)
    return {STARTED: began_utc} if began_utc else {}


def _identity(experiment: Experiment, performed: Performance | None) -> dict[str, object]:
    """What the run is of, with the serial number that a person told in the run, where none was typed."""
    told = None if performed is None else performed.sensor_serial
    return {**experiment.identity, "sensor_serial": experiment.identity["sensor_serial"] or told}


def _summary(
    identity: dict[str, object], results: Mapping[type, object], verdict: Verdict, performed: Performance | None, wall_s: float,
    judged: Reproducible,
) -> dict[str, Any]:  # fmt: skip
    calibration, found = results.get(Calibration), results.get(Evaluation)
    assert calibration is None or isinstance(calibration, Calibration)
    assert found is None or isinstance(found, Evaluation)
    protocol = None if performed is None else performed.document
    return summary(identity, calibration, found, verdict, wall_s, judged, protocol)


def _keep_baseline(world: World, told: Mapping[str, Any], results: Mapping[type, object], verdict: Verdict, path: Path) -> None:
    """A run that ended with the baseline leaves what it has found of the sensor."""
    base = results.get(BaselineResult)
    if isinstance(base, BaselineResult) and Calibration not in results:
        held = {"sensor": told["sensor"], "serial": told["sensor_serial"], "profile": told["profile"], "air": told["air"]}
        write_whole(path, baseline_yaml(base, verdict, held, made_of(world)))
