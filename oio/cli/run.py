"""The command `python -m oio.run`: compose, build, check, run. Known errors end in one paragraph: exit code 2 for bad input, else 1.

A verdict FAIL is exit code 3.
"""

import importlib
import logging
import os
import sys
from pathlib import Path
from typing import Any

import hydra
from hydra.core.hydra_config import HydraConfig
from hydra.core.plugins import Plugins
from hydra.types import RunMode
from omegaconf import DictConfig

from oio.cli.build import build
from oio.cli.console import show_summary
from oio.cli.execute import execute
from oio.cli.exit_codes import VERDICT_FAILED, run_command
from oio.cli.hydra_errors import known_error
from oio.cli.options import refuse_unknown_options
from oio.cli.outcome import FAILED, TO_REPORT, TO_SHOW, VERDICTS, raise_first, show_all, verdict_failed
from oio.cli.plugins import plugin_packages, search_path, without_search_path
from oio.cli.replay_overrides import replayed
from oio.cli.run_folder import state_of, write_status
from oio.cli.sweep_check import refuse_bad_choices
from oio.cli.trials_table import show_trials
from oio.core import interrupt
from oio.core.errors import BadInput
from oio.core.folders import CONF, ROOT


def job(cfg: DictConfig) -> dict[str, Any]:
    """Hydra's task function: one run. Jobs of a sweep come here only by launchers other than the project's own."""
    told = HydraConfig.get()
    out, sweeping = Path(told.runtime.output_dir), told.mode == RunMode.MULTIRUN
    try:
        document = execute(build(cfg, dict(told.runtime.choices), list(told.overrides.task)), out, quiet=sweeping)
    except Exception as error:
        if sweeping:
            _note_failure(out, error)
        else:
            _leave_nothing(out)
            FAILED.append(error)  # raised through Hydra it would be printed twice
        return {}
    if not sweeping:
        if cfg.trials > 1:
            TO_SHOW.append(lambda: show_trials(document, f"trials.csv and numbers are in {out}"))
        else:
            TO_SHOW.append(lambda: show_summary(document, f"log, calibration and numbers are in {out}"))
        VERDICTS.append(document["verdict"])
        if cfg.report and (out / "run.mcap").is_file():
            TO_REPORT.append(out)
    return document


def _leave_nothing(out: Path) -> None:
    if out.is_dir() and not any(out.iterdir()):
        out.rmdir()


def _note_failure(out: Path, error: Exception) -> None:
    """Write the failure of a job to its status.json, so that the others go on; a folder that was used before stops the sweep."""
    known = known_error(error, CONF)
    if state_of(out)[0] == "missing":
        write_status(out, "failed", str(known or repr(error)))
    elif isinstance(known, BadInput):
        raise error


def check_packages() -> None:
    """Refuse to start where `hardware` or `pipelines` is another distribution's package, and not the one beside `oio`."""
    for name in ("pipelines", "hardware"):
        if not (ROOT / name / "__init__.py").is_file():
            raise BadInput(f"the package '{name}' does not lie beside 'oio' in {ROOT}. Install OIO in a venv of its own: make venv.")
    sys.path.insert(0, str(ROOT))


def _register_launchers() -> None:
    """Load Hydra's plugins, then register the project's launchers once more: of one name the last counts, and plugins have no order."""
    Plugins.instance()
    importlib.import_module("hydra_plugins.oio_launchers").register()


def _run(arguments: list[str]) -> None:
    check_packages()
    refuse_unknown_options(arguments)
    arguments, own = without_search_path(replayed(arguments))
    arguments += search_path([*own, *plugin_packages()])
    if {"-m", "--multirun"} & set(arguments):
        refuse_bad_choices(arguments)
    _register_launchers()
    os.environ["HYDRA_FULL_ERROR"] = "1"  # errors are printed by `run_command`, as one paragraph
    logging.raiseExceptions = False  # Hydra prints --info by logging, which shows a trace where nobody reads it any more
    sys.argv = [sys.argv[0], *arguments]
    hydra.main(version_base="1.3", config_path=str(CONF), config_name="config")(job)()
    raise_first()


def main() -> int:
    """Run the command; returns the exit code."""
    interrupt.listen()
    stopped = "stopped; what was logged so far can be read (python -m oio.recover RUN/run.mcap.part)."
    code = run_command(lambda: _run(sys.argv[1:]), stopped)
    show_all()
    return VERDICT_FAILED if verdict_failed() and not code else code
