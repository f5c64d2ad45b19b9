"""What a command line of `python -m oio.localise` asks for: KEY=VALUE words, sorted by who reads them."""

import csv
import difflib
from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from oio.core.errors import BadInput
from oio.results.yaml_fields import plain_yaml
from oio.tabular.mapping import TableMapping

EXAMPLE = "Type e.g. python -m oio.localise walk.csv sensor=ndir nose_columns=[x,y,z] position_unit=mm."
MAPPING = tuple(entry.name for entry in fields(TableMapping))  # keys of conf/recording/csv.yaml
CHOSEN = ("sensor", "arm", "profile")  # of conf/
PLACES = ("beacon_m", "box_m")
NAMES = ("columns", "climate_columns", "nose_columns", "joint_columns")  # lists of columns, in whose names anything may stand
MOST_S = 10.0  # of the standard uncertainty of the offset between the stamps of gas and positions
NEAR = 0.8  # least similarity (difflib's ratio) of a mistyped key
SPANS = ("clean_air_s", "beacon_s", "search_s")


@dataclass(frozen=True, slots=True)
class Asked:
    """File, its mapping, choices of conf/, places [m] and spans of time [s] of the log, calibration to use, folder for results, and keys
    of conf/ with other values."""

    file: Path
    mapping: dict[str, object]
    chosen: dict[str, str]
    places: dict[str, list[Any]]
    spans: dict[str, tuple[float, float]]
    calibration: Path | None
    out: Path | None
    overrides: dict[str, object] = field(default_factory=dict)
    clock_u_s: float | None = None
    positions: Path | None = None  # file of the positions, if it is another

    @property
    def calibrates(self) -> bool:
        """Whether a calibration is to be made of the log itself."""
        return "beacon_m" in self.places


def asked(arguments: Sequence[str]) -> Asked:
    """Sort the words of a command line. Raises BadInput for what does not go together, and for what has no value."""
    files = [word for word in arguments if "=" not in word]
    if len(files) != 1 or files[0].startswith("-"):
        raise BadInput(f"{' '.join(arguments) or 'nothing'} was given, but one log is localised in at a time. {EXAMPLE}")
    values = dict(_value(word) for word in arguments if "=" in word)
    taken = {*MAPPING, *CHOSEN, *PLACES, *SPANS, "calibration", "out", "clock_u_s", "positions"}
    made = Asked(
        Path(files[0]),
        {key: values[key] for key in MAPPING if key in values},
        {key: str(values[key]) for key in CHOSEN if key in values},
        {key: _list(key, values[key], "numbers in metres, e.g. beacon_m=[0.33,0.10,0.16]") for key in PLACES if key in values},
        {key: _span(key, values[key]) for key in SPANS if key in values},
        Path(str(values["calibration"])) if "calibration" in values else None,
        Path(str(values["out"])) if "out" in values else None,
        {key: value for key, value in values.items() if key not in taken},
        _number("clock_u_s", values["clock_u_s"]) if "clock_u_s" in values else None,
        Path(str(values["positions"])) if "positions" in values else None,
    )
    for key in made.overrides:
        near = difflib.get_close_matches(key, sorted(taken), 1, NEAR)
        if near and "." not in key:
            raise BadInput(f"'{key}' is no key of this command. The nearest that exists is {near[0]}; --help lists them.")
    _check(made)
    return made


def _check(made: Asked) -> None:
    spans = {"clean_air_s", "beacon_s"} & set(made.spans)
    if made.calibrates and len(spans) < 2:
        raise BadInput("beacon_m was given, so the log calibrates. Type when: clean_air_s=[BEGIN,END] beacon_s=[BEGIN,END], in seconds.")
    if spans and not made.calibrates:
        raise BadInput(f"{', '.join(sorted(spans))} was given, but not where the beacon stood. Type beacon_m=[X,Y,Z], in metres.")
    if made.calibrates and made.calibration:
        raise BadInput("calibration and beacon_m were both given, but a calibration is read or made. Leave one out.")
    if "sensor" not in made.chosen and not made.calibration:
        raise BadInput("no sensor was given, and no calibration, which names one. Type sensor=ec (ndir, pa, mox_mq, mox_mics).")
    if made.calibration and not made.calibration.is_file():
        raise BadInput(f"calibration={made.calibration} was given, but there is no such file. Give a calibration.yaml.")
    if made.calibration and (made.chosen or made.overrides):
        others = ", ".join((*made.chosen, *made.overrides))
        raise BadInput(f"{others} was given, but {made.calibration} says sensor, arm and profile itself. Leave it out.")


def _value(word: str) -> tuple[str, object]:
    key, _, text = word.partition("=")
    key = key.removeprefix("recording.")
    return key, _names(text) if key in NAMES else plain_yaml(text, word, EXAMPLE)


def _names(text: str) -> list[str]:
    """Names of columns between commas, with or without brackets about the list, and with or without quotes about a name."""
    inner = text[1:-1] if text.startswith("[") and text.endswith("]") else text
    return [name.strip() for name in next(csv.reader([inner], skipinitialspace=True), []) if name.strip()]


def _number(key: str, value: object) -> float:
    if not isinstance(value, int | float) or isinstance(value, bool) or not 0.0 <= value <= MOST_S:
        raise BadInput(f"{key}={value} was given, but it is a number of seconds from 0 to {MOST_S:g}. Type e.g. {key}=0.3.")
    return float(value)


def _list(key: str, value: object, wanted: str) -> list[Any]:
    if not isinstance(value, list):
        raise BadInput(f"{key}={value} was given, but it is a list of {wanted}.")
    return value


def _span(key: str, value: object) -> tuple[float, float]:
    entries = _list(key, value, "two times in seconds since the log began, e.g. search_s=[140,200]")
    if len(entries) != 2 or not all(isinstance(entry, int | float) and not isinstance(entry, bool) for entry in entries):
        raise BadInput(f"{key}={value} was given, but it is two times in seconds since the log began. Type e.g. {key}=[140,200].")
    return float(entries[0]), float(entries[1])
