"""Table I of the paper: calibration time and error of every sensor."""

from pathlib import Path
from typing import NamedTuple

import yaml


class Published(NamedTuple):
    """What the paper gives for one sensor: total calibration time [s] and error [ppm]."""

    time_s: float
    error_ppm: float


def table_1(conf: Path) -> dict[str, Published]:
    """By sensor, from the folder of the configuration."""
    rows = yaml.safe_load((conf / "table_1.yaml").read_text(encoding="utf-8"))
    return {sensor: Published(**row) for sensor, row in rows.items()}
