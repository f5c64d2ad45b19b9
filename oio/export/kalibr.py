"""A calibrated gas sensor in the form that Kalibr gives an IMU: noise density, random walk, rate, time shift, place in the last link.

Kalibr's formats: https://github.com/ethz-asl/kalibr/wiki/yaml-formats (`rostopic`, `update_rate`, `*_noise_density`, `*_random_walk`,
`T_cam_imu`, `timeshift_cam_imu`); its reader takes a density over sqrt(update_rate): sigma of a reading = density * sqrt(update_rate).
What a gas sensor has no counterpart for is left out, and said so in the file.
"""

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from oio.core.errors import BadInput
from oio.core.records import Array
from oio.export.run_record import RunRecord, rate_hz, stamps_s
from oio.export.yaml_number import yaml_number
from oio.log import read_attachment
from oio.results.calibration_entries import CalibrationEntries, calibration_entries

HEAD = """\
# OIO: gas sensor of {title}
# in the form of Kalibr's imu.yaml and camchain.yaml; ppm, s, m.
# Left out, because a gas sensor has none: accelerometer_*, gyroscope_*, model, and the rotation of the nose (a point; that of the link is
# written). Left out, because Kalibr has none: gain, offset and lag (tau_rise {rise:.4g} s, tau_fall {fall:.4g} s: first order, no time
# shift). They are in calibration.yaml.
"""
ELEMENT = """\
gas{e}:
  rostopic: {topic}
  update_rate: {rate_hz}  # Hz, median, of this element
  gas_noise_density: {density}  # ppm/sqrt(Hz), white: sqrt(R_white / update_rate)
{walk}
  timeshift_gas_joints: {shift_s}  # s, t_joints = t_gas + shift: minus the delay of calibration.yaml
{place}
"""
WALK = "  gas_random_walk: {walk}  # ppm/s/sqrt(Hz) = ppm/sqrt(s), of the offset: the filter's assumption (process_noise), not measured"
NO_WALK = "  # gas_random_walk: left out, calibration.yaml has no Q_per_s_diagonal of the offset"
PLACE = "  T_gas_link:  # takes coordinates of the last moving link to those of the nose, m\n{rows}"
NO_PLACE = "  # T_gas_link: left out, the log has no model of the arm"


def write_kalibr(run: RunRecord, folder: Path) -> list[Path]:
    """Write gas.yaml, a block per element; returns its path. Raises BadInput where the log has no calibration or too few samples."""
    entries = calibration_entries(read_attachment(run.log, "calibration.yaml").decode(errors="replace"), str(run.log))
    rise, fall = (entries.need(f"sensor.{name}").value for name in ("tau_rise", "tau_fall"))
    blocks = [_element(run, entries, e) for e in range(entries.elements)]
    (folder / "gas.yaml").write_text(HEAD.format(title=run.title, rise=rise, fall=fall) + "".join(blocks), encoding="utf-8")
    return [folder / "gas.yaml"]


def _element(run: RunRecord, entries: CalibrationEntries, e: int) -> str:
    rate = rate_hz(stamps_s(sample for sample in run.samples if sample.element == e), f"samples of element {e}", run.log)
    white_ppm2, shift_s = entries.need(f"sensor.element_{e}.R_white").value, -entries.need("sensor.delay").value
    if white_ppm2 < 0.0:
        raise BadInput(f"{run.log}: sensor.element_{e}.R_white is {white_ppm2:g} ppm^2, but a variance is 0 or more.")
    q_ppm2_s = _offset_walk(entries.document.get("filter"), e)
    return ELEMENT.format(
        e=e, topic=json.dumps(f"/gas/{run.identity.get('sensor', '')}/sample"), rate_hz=yaml_number(rate),
        density=yaml_number(math.sqrt(white_ppm2 / rate)),
        walk=NO_WALK if q_ppm2_s is None else WALK.format(walk=yaml_number(math.sqrt(q_ppm2_s))),
        shift_s=yaml_number(shift_s), place=_place(run),
    )  # fmt: skip


def _offset_walk(stored: Mapping[str, Any] | None, e: int) -> float | None:
    """Process noise of an element's offset [ppm^2/s]; None where the file does not have it."""
    try:
        q = float(stored["Q_per_s_diagonal"][stored["states"].index(f"baseline_{e}")])  # type: ignore[index]
    except (TypeError, KeyError, ValueError, IndexError, AttributeError):
        return None
    return q if 0.0 <= q < math.inf else None


def _place(run: RunRecord) -> str:
    if run.arm is None:
        return NO_PLACE
    transform: Array = np.eye(4)
    transform[:3, 3] = -run.arm.chain.nose_offset
    return PLACE.format(rows="\n".join(f"  - [{', '.join(map(yaml_number, row))}]" for row in transform.tolist()))
