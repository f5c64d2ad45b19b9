"""A recording of conf/recording as a record: composed as a run would, read as its backend would."""

from collections.abc import Mapping, Sequence
from typing import Protocol

from hydra.utils import instantiate

from oio.cli.compose import compose
from oio.cli.plugins import plugin_packages
from oio.core.errors import BadInput
from oio.core.records import Array
from oio.gas.detection_rule import DetectionRule
from oio.identify.record import ElementReadings, Record

CAUTION = "What the gas of the room does counts as noise and drift of the sensor: they are upper limits unless its air was clean."


class Rows(Protocol):
    """What is needed of the rows of a recording's loader."""

    t_s: Array
    ppm: Array
    release_s: float
    columns: tuple[str, ...]
    unit: str
    climate: Array | None
    dropped: Mapping[str, int]

    @property
    def account(self) -> str:
        """Summary of what was dropped."""
        ...


def read_recording(words: Sequence[str]) -> Record:
    """Read the recording that the overrides choose; raises BadInput without one, or what Hydra raises for a wrong word."""
    if not any(word.startswith("recording=") for word in words):
        raise BadInput(f"{words[0]} was given, but no recording. Type e.g. python -m oio.identify recording=sgp30_64h.")
    cfg = compose(["backend=recording", *words], tuple(plugin_packages())).cfg
    rows: Rows = instantiate(cfg.recording, _convert_="all").load()
    names = rows.columns or tuple(f"column {i}" for i in range(rows.ppm.shape[1]))
    clean = rows.t_s < rows.release_s if rows.release_s > 0.0 else rows.t_s >= 0.0
    kept = {
        name: ElementReadings(name, rows.t_s[clean], rows.ppm[clean, i]) for i, name in enumerate(names)
    }  # one column may be played twice
    climate = None if rows.climate is None else rows.climate[clean]
    return Record(tuple(kept.values()), rows.unit, rows.account, CAUTION, climate)


def bout_rule(words: Sequence[str]) -> tuple[str, DetectionRule, int]:
    """Return the name of the chosen bout rule, the rule, and its window."""
    composed = compose(list(words), tuple(plugin_packages()))
    rule: DetectionRule = instantiate(composed.cfg.bout)
    return composed.choices["bout"], rule, rule.window(int(composed.cfg.dof))
