"""One trial of `drift`: calibrate, then hover about the beacon or search, and measure the nose error of the filter."""

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from oio.bench.hover import Hover, Hovered
from oio.bench.nose_error import NoseErrorSample, NoseLog, errors, nose_error_at
from oio.bench.trial import experiment
from oio.cli.experiment import Experiment
from oio.cli.hydra_errors import known_error
from oio.core.folders import CONF
from oio.results.calibration import Navigation
from oio.runtime.runner import Stage, run_stages

CALIBRATION = ("warm_up", "baseline", "calibrate_bouts", "map_beliefs", "assemble_qr")
SOURCES = ("known", "unknown")
STEP_S = 20.0  # sampling interval of the figure


class Case(NamedTuple):
    """Configuration shared by trials that differ in seed only."""

    sensor: str
    air: str
    dof: int
    ekf: str
    source: str

    def words(self, until_s: float) -> tuple[str, ...]:
        """Return the case as overrides of the configuration."""
        own = (f"{key}={getattr(self, key)}" for key in ("sensor", "air", "dof", "ekf"))
        return ("+experiment=drift", *own, f"stage.navigate.max_s={until_s}")


@dataclass(frozen=True)
class Times:
    """Times [s]: when to evaluate, over which window before, and the dwell of a sniff about the beacon."""

    after_s: tuple[float, ...]
    window_s: float
    dwell_s: float


def try_trial(words: tuple[str, ...], source: str, seed: int, times: Times) -> tuple[list[NoseErrorSample], str]:
    """Return the errors every STEP_S and at the evaluation times, or none and the reason of the failure."""
    try:
        return run_trial(words, source, seed, times), ""
    except Exception as error:
        return [], str(known_error(error, CONF) or repr(error))


def run_trial(words: tuple[str, ...], source: str, seed: int, times: Times) -> list[NoseErrorSample]:
    """Calibrate, then hover about the beacon or search, and return the nose errors."""
    built, log = experiment(words, seed), NoseLog()
    stages: dict[str, Stage] = {name: built.stages[name] for name in CALIBRATION}
    stages[source] = _hover(built, times) if source == "known" else built.stages["navigate"]
    with tempfile.TemporaryDirectory() as folder, built.backend.open() as world:
        results = run_stages(stages, world, built.arm, log, Path(folder), seed, built.sensor.highest_raw)
    result = results[Hovered if source == "known" else Navigation]
    assert isinstance(result, Hovered | Navigation)
    series = errors(log, built.arm, result.began_ns)
    ticks = sorted({*times.after_s, *np.arange(STEP_S, times.after_s[-1], STEP_S).tolist()})
    return [sample for t in ticks if (sample := nose_error_at(series, t, times.window_s)) is not None]


def _hover(built: Experiment, times: Times) -> Hover:
    navigate: Any = built.stages["navigate"]
    mapped: Any = built.stages["map_beliefs"]
    return Hover(
        sensor=built.sensor, arm=built.arm, ekf=navigate.ekf, belief_map=navigate.belief_map,
        place=np.array(mapped.beacon.position), approach_m=mapped.beacon.approach_m, distances_m=mapped.distances_m,
        dwell_s=times.dwell_s, for_s=times.after_s[-1],
    )  # fmt: skip
