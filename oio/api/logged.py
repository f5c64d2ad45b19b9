"""`load_run` and `Run`: a finished run as tables and arrays."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from oio.api.calibration import Calibration
from oio.api.calibration_file import calibration_of
from oio.api.samples import JointPath, Readings
from oio.api.setup import Setup
from oio.api.tables import Frame, as_frame
from oio.core.errors import BadInput
from oio.core.records import Belief, Event, seconds
from oio.export.run_record import find_log, record_of
from oio.export.tables import Table, tables
from oio.log import LoggedRun, read_attachment, read_run
from oio.results.calibration_fit import SCHEMA


@dataclass(frozen=True, eq=False)
class Run:
    """A run. Times are seconds since its world opened; units end the names of columns.

    `summary`: what summary.json says, {} where the log was given without its folder. `metadata`: sensor, dof, seed, versions and all else
    that the log says of itself. `stages`: (begin, end) [s] by name. `beliefs`: every logged state of the filter, with the names of its
    entries. `calibration`: None where the run made or loaded none.
    """

    summary: dict[str, Any]
    metadata: dict[str, str]
    stages: dict[str, tuple[float, float]]
    beliefs: tuple[tuple[tuple[str, ...], Belief], ...]
    verdict: str
    calibration: Calibration | None
    columns: Mapping[str, Table]

    @property
    def readings(self) -> Frame:
        """Gas samples: t_s, element, raw, ppm, sigma_ppm, and the ppm of each element; a DataFrame where pandas is installed, else a
        structured array, with columns by the same names."""
        return as_frame(self.columns.get("readings", {}))

    @property
    def joints(self) -> Frame:
        """Joint states: t_s, and NAME_q_rad, NAME_dq_rad_s, NAME_ddq_rad_s2 of every moving joint (m for those that slide)."""
        return as_frame(self.columns.get("joints", {}))

    @property
    def track(self) -> Frame:
        """Nose as estimated (with covariance), by dead reckoning and in truth; source as estimated and in truth; NaN where unknown."""
        return as_frame(self.columns.get("tracks", {}))

    def samples(self, stage: str = "navigate") -> tuple[Readings, JointPath]:
        """Return what was sensed in a stage, as `locate` takes it. Raises BadInput for a stage that was not run, or sensed nothing."""
        if stage not in self.stages:
            raise BadInput(f"stage '{stage}' was asked for, but this run had {', '.join(self.stages) or 'none'}.")
        gas, joints = self.columns.get("readings", {}), self.columns.get("joints", {})
        if not gas or not joints:
            raise BadInput("this run has no samples, so that there is nothing to fit. Give a run that went further.")
        q = np.stack([values for name, values in joints.items() if name.rpartition("_q_")[1]], axis=1)
        span = self.stages[stage]
        return Readings(gas["t_s"], raw=gas["raw"], element=gas["element"]).between(*span), JointPath(joints["t_s"], q).between(*span)


def load_run(path: str | Path, setup: Setup | None = None) -> Run:
    """Read a run: its folder, or its run.mcap, in one go. Nothing in it is built or run.

    `setup`: sensor and arm of its calibration; None: those that it names, with the numbers of conf/ as they are. Raises BadInput for
    anything but a finished run, with the command that mends one that was cut off.
    """
    given = Path(path)
    if not given.exists():
        raise BadInput(f"{given} was given, but there is no such file or folder. Give the folder of a run, or its run.mcap.")
    log = find_log(given)
    run, folder = read_run(log), given if given.is_dir() else given.parent
    columns = {name: dict(table) for name, table in tables(record_of(log, run)).items()}
    summary = _json(folder / "summary.json")
    return Run(summary, run.metadata, _stages(run), tuple(run.states), _verdict(run), _calibration(log, setup), columns)


def _json(path: Path) -> dict[str, Any]:
    if not path.is_file():
        return {}
    try:
        loaded = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise BadInput(f"{path} cannot be read: {error}. Give the folder of a run as it was left.") from None
    return loaded if isinstance(loaded, dict) else {}


def _stages(run: LoggedRun) -> dict[str, tuple[float, float]]:
    begun: dict[str, float] = {}
    spans: dict[str, tuple[float, float]] = {}
    for t_ns, name, state in run.stages:
        if state == "begin":
            begun[name] = seconds(t_ns)
        elif name in begun:
            spans[name] = (begun[name], seconds(t_ns))
    return spans


def _verdict(run: LoggedRun) -> str:
    """First word of the verdict that was logged; empty without one."""
    said = [sample.text for sample in run.samples if isinstance(sample, Event) and sample.kind == "verdict"]
    return said[-1].partition(".")[0] if said else ""


def _calibration(log: Path, setup: Setup | None) -> Calibration | None:
    try:
        text = read_attachment(log, "calibration.yaml").decode("utf-8", "replace")
    except BadInput:
        return None
    return calibration_of(text, f"calibration.yaml in {log}", setup) if SCHEMA in text[:200] else None
