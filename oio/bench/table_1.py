"""Table I of the paper, to compare with."""

from typing import NamedTuple

import yaml

from oio.run import CONF


class Published(NamedTuple):
    """What the paper gives for one sensor: total calibration time [s] and error [ppm]."""

    time_s: float
    error_ppm: float


def table_1() -> dict[str, Published]:
    """By sensor."""
    rows = yaml.safe_load((CONF / "table_1.yaml").read_text(encoding="utf-8"))
    return {sensor: Published(**row) for sensor, row in rows.items()}
