"""A calibration that was kept: calibration.yaml read back, every value checked, nothing in it ever built or run."""

from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path

import numpy as np

from oio.core.errors import BadInput
from oio.gas.bouts import ElementBaseline
from oio.gas.fluctuation import Fluctuation
from oio.gas.range_law import RangeLaw
from oio.gas.timing import Delay
from oio.inference.forward_model import ParameterLayout
from oio.inference.map_fit import Fit
from oio.inference.uncertainty import Noise
from oio.kinematics.arm import Arm
from oio.results.calibration_entries import calibration_entries
from oio.results.calibration_fit import FIXED, SCHEMA, parameter_names, parameter_units
from oio.results.yaml_fields import Fields, plain_yaml

DAY_S = 86400.0
EXAMPLE = "Give the calibration.yaml of a run."


@dataclass(frozen=True)
class Made:
    """When a calibration was made (UTC, ISO 8601; None of a simulation, which has no date), and what its devices said of themselves."""

    started: str | None
    devices: dict[str, str | None]

    def days_before(self, began_utc: str | None) -> float | None:
        """Age [days] at another moment; None where one of both has no date."""
        if self.started is None or began_utc is None:
            return None
        return (datetime.fromisoformat(began_utc) - datetime.fromisoformat(self.started)).total_seconds() / DAY_S


@dataclass(frozen=True)
class KeptCalibration:
    """A calibration read from a file: for what it holds, the fit, the noise of both assemblies, and the figures of the summary."""

    file: str
    text: str  # of the file
    holds_for: dict[str, str]
    serial: str | None  # of the sensor, if the run was told
    joints: tuple[str, ...]
    made: Made
    verdict: str
    fit: Fit
    noises: dict[str, Noise]
    delay: Delay
    baselines: tuple[ElementBaseline, ...]
    time_s: float
    error_ppm: float
    u_a_ppm: float
    u_b_m: float
    moves: int
    highest_ppm: tuple[float, ...] | None  # None of a file that does not say


def read_kept(path: str, arm: Arm, law: RangeLaw) -> KeptCalibration:
    """Read and check a calibration.yaml. Raises BadInput where it cannot be read, is not whole, or was made with other joints or another
    reference distance."""
    return kept_of(_text(path), path, arm, law)


def kept_of(text: str, path: str, arm: Arm, law: RangeLaw) -> KeptCalibration:
    """Check the text of a calibration.yaml; `path` names it in errors, which are those of `read_kept`."""
    read = Fields(plain_yaml(text, path, EXAMPLE), path)
    if read.text("schema") != SCHEMA:
        made = f"{path} has schema '{read.text('schema')}', but a run can begin with {SCHEMA} alone"
        raise BadInput(f"{made}. Give the calibration.yaml of a run with the stage assemble_qr.")
    calibration_entries(text, path)  # what a person reads of it: values, uncertainties and units, each checked
    held = read.section("holds_for")
    names = {name: held.text(name) for name in ("sensor", "arm", "profile", "air")}
    joints = held.texts("joints")
    if (names["arm"], joints) != (arm.name, arm.names):
        made = f"{path} was made with arm={names['arm']}, joints {', '.join(joints)}"
        raise BadInput(
            f"{made}, but this run has arm={arm.name}, joints {', '.join(arm.names)}. Type dof={len(joints)}, or calibrate again."
        )
    baselines = tuple(_baseline(b) for b in read.sections("baselines"))
    totals, verdict = read.section("totals"), read.section("verdict")
    paper, late = read.section("paper_values"), read.section("fit").section("delay")
    return KeptCalibration(
        path, text, names, held.maybe_text("serial"), joints, _made(read.section("made")), verdict.text("overall"),
        _fit(read.section("fit"), arm, len(baselines), law),
        {name: _read_noise(name, read.section("assemblies").section(name)) for name in ("gum", "paper")},
        Delay(late.number("s"), late.number("u_s", 0.0)),
        baselines, totals.number("time_s", 0.0), totals.number("error_ppm", 0.0),
        paper.section("u_a").number("value", 0.0), paper.section("u_b").number("value", 0.0), totals.whole("moves"),
        None if "highest_ppm" not in read.names else tuple(read.numbers("highest_ppm", len(baselines)).tolist()),
    )  # fmt: skip


def _text(path: str) -> str:
    if not Path(path).is_file():
        raise BadInput(
            f"calibration={path} was given, but there is no such file. Type calibration=RUN/calibration.yaml of a run that is done."
        )
    try:
        return Path(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise BadInput(f"{path} cannot be read: {error}. {EXAMPLE}") from None


def _made(read: Fields) -> Made:
    started = read.maybe_text("started")
    try:
        dated = started is None or datetime.fromisoformat(started).tzinfo is not None
    except ValueError:
        dated = False
    if not dated:
        raise BadInput(
            f"made.started of the calibration is '{started}', but it must be a time with its offset from UTC (ISO 8601), or null."
        )
    return Made(started, {name: read.section("devices").maybe_text(name) for name in read.section("devices").names})


def _baseline(read: Fields) -> ElementBaseline:
    return ElementBaseline(
        read.number("ppm"), read.number("sigma_ppm", 0.0), read.number("highest_ppm"), read.whole("n", 1), read.number("n_effective", 1e-9)
    )


def _fit(read: Fields, arm: Arm, elements: int, law: RangeLaw) -> Fit:
    layout = ParameterLayout(arm.dof, elements)
    expected = {"parameters": parameter_names(arm.names, elements), "units": parameter_units(arm.units, elements)}
    for key, names in expected.items():
        if read.texts(key) != names:
            raise BadInput(f"fit.{key} of the calibration is {', '.join(read.texts(key))}, but it must be {', '.join(names)}.")
    fitted, noise = read.section("law"), read.section("fluctuation")
    for key in FIXED:
        if fitted.number(key) != getattr(law, key):
            made = f"the calibration was made with range_law.{key}={fitted.number(key):g}"
            raise BadInput(f"{made}, but this run has {getattr(law, key):g}. Type range_law.{key}={fitted.number(key):g}.")
    return Fit(
        layout, read.numbers("mean", layout.size), read.covariance("cov", layout.size), np.inf, 0.0,
        _fluctuation(noise), read.whole("readings"),
        replace(law, nose_jitter_m=fitted.number("nose_jitter_m", 0.0), model_discrepancy=fitted.number("model_discrepancy", 0.0)),
    )  # fmt: skip


def _fluctuation(noise: Fields) -> Fluctuation:
    found = Fluctuation(noise.number("scale", 1e-12), noise.number("gamma", 0.0), noise.number("t_s", 1e-9))
    if "sway" not in noise.names:
        return found  # a calibration by a version that knew none
    return replace(found, sway=noise.number("sway", 0.0), sway_s=noise.number("sway_s", 1e-9))


def _read_noise(assembly: str, read: Fields) -> Noise:
    return Noise(
        assembly, read.number("source_q_m2", 0.0), read.maybe_number("r_ppm2", 0.0), read.number("source_p0_m2", 0.0),
        read.whole("measurements", 1), read.number("inflation", 1e-9),
    )  # fmt: skip
