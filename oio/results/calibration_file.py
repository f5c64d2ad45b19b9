"""Writer of calibration.yaml: value, standard uncertainty, unit, degrees of freedom, method (A statistical, B other) of each quantity."""

from collections.abc import Mapping
from dataclasses import asdict

import numpy as np
import yaml

from oio.core.records import Array
from oio.inference.uncertainty import Noise
from oio.results.calibration import BaselineResult, BoutCalibration, Calibration, MapCalibration
from oio.results.calibration_fit import SCHEMA, fit_entries
from oio.results.calibration_quantities import Entry, arm_entries, entry, range_law_entries, sensor_entries
from oio.results.criteria.judgement import Verdict

BASELINE_SCHEMA = "oio.results.baseline/1"


def calibration_yaml(
    calibration: Calibration, bouts: BoutCalibration, found: MapCalibration, noises: dict[str, Noise], holds_for: Mapping[str, str | None],
    made: dict[str, object], verdict: Verdict, t_ns: int,
) -> str:  # fmt: skip
    """Return the whole file as text; plain data only, so that loading it never constructs an object.

    `noises`: of both assemblies. `holds_for`: names of sensor, arm, profile and air, and the sensor's serial number if known.
    `made`: when, and on which devices.
    """
    document = {
        "schema": SCHEMA,
        "made": made,
        "sensor": sensor_entries(calibration, found),
        "range_law": range_law_entries(calibration, found),
        "arm": arm_entries(calibration, found),
        "type_a": [_rung(rung) for rung in bouts.rungs],
        "type_b": _type_b(found),
        "filter": _filter(calibration, t_ns),
        "paper_values": {
            "u_a": {"value": calibration.u_a_ppm, "unit": "ppm"},
            "u_b": {"value": calibration.u_b_m, "unit": "m"},
        },
        **fit_entries(calibration, found, noises, holds_for),
        "verdict": _verdict(verdict),
    }
    return yaml.safe_dump(document, sort_keys=False, default_flow_style=None, width=140)


def baseline_yaml(base: BaselineResult, verdict: Verdict, holds_for: Mapping[str, str | None], made: dict[str, object]) -> str:
    """Return the file of a run that ended with the baseline: offsets and noise of the sensor, and no more. No run can begin with it.

    `made`: when, and on which devices.
    """
    elements = {
        f"element_{e}": {"baseline": entry(b.ppm, b.u_ppm, "ppm", b.n_effective - 1, "A"), "readings": b.n, "sigma_ppm": b.sigma_ppm}
        for e, b in enumerate(base.elements)
    }
    document = {
        "schema": BASELINE_SCHEMA, "made": made, "sensor": {**elements, "noise_over_data_sheet": base.noise_scale}, "holds_for": holds_for,
        "verdict": _verdict(verdict),
    }  # fmt: skip
    return yaml.safe_dump(document, sort_keys=False, default_flow_style=None, width=140)


def _verdict(verdict: Verdict) -> Entry:
    return {"overall": verdict.word, "reasons": list(verdict.reasons), "criteria": [asdict(j) for j in verdict.judgements]}


def _rung(rung: object) -> Entry:
    r = {name: getattr(rung, name) for name in ("dof", "k", "s_ppm", "u_a_ppm", "u_a_effective_ppm", "bouts", "moves")}
    u_a = entry(r["u_a_effective_ppm"], r["u_a_effective_ppm"] / np.sqrt(2 * max(r["bouts"] - 1, 1)), "ppm", max(r["bouts"] - 1, 0), "A")
    return {"rung": r["dof"], "window": r["k"], "bouts": r["bouts"], "moves": r["moves"], "u_a": u_a, "u_a_paper": r["u_a_ppm"]}


def _type_b(found: MapCalibration) -> Entry:
    b = found.type_b
    repeats = len(b.misses_m)
    return {
        "rms": entry(b.rms_m, b.rms_m / np.sqrt(2 * repeats), "m", repeats, "A"),
        "inflation": b.inflation,
        "misses_m": list(b.misses_m),
        "moves": list(b.moves),
        "u_b_paper": b.u_b_m,
    }


def _filter(calibration: Calibration, t_ns: int) -> Entry:
    model, known = calibration.chosen.model, calibration.chosen
    q = model.process_noise_diagonal(1.0)
    r = model.noise.r_ppm2 if model.noise.r_ppm2 is not None else model.fluctuation.scale * model.sigma_ppm**2
    return {
        "assembly": model.noise.assembly,
        "t_s": t_ns / 1e9,
        "states": list(model.names),
        "units": list(model.units),
        "Q_per_s_diagonal": [float(v) for v in q],
        "R_clean_air_ppm2": [[float(r)]],
        "P0_source_added_m2": [[model.noise.source_p0_m2 * (i == j) for j in range(3)] for i in range(3)],
        "P0_prior_parameters": _matrix(known.cov),
    }


def _matrix(a: Array) -> list[list[float]]:
    return [[float(v) for v in row] for row in a]
