"""Reader of calibration.yaml: its quantities by dotted key, e.g. `sensor.element_1.gain`, validated, and what stands beside them.

The file is data: plain YAML, nothing in it is built or evaluated. Sections that are not known are left alone.
"""

import contextlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from oio.core.errors import BadInput
from oio.log import read_attachment, read_metadata
from oio.results.calibration_fit import SCHEMA
from oio.results.quantity import Quantity, read_quantity, shown
from oio.results.yaml_fields import plain_yaml

SECTIONS = ("sensor", "range_law", "arm", "type_a", "type_b")  # in which every mapping with a value is a quantity
REQUIRED = SECTIONS[:3]
HOLDS_FOR = ("sensor", "serial", "arm", "profile", "air")  # names of the choices that a file holds for, where it says so
QUANTITIES = frozenset((
    "baseline", "gain", "R_white", "tau_rise", "tau_fall", "delay", "error",
    "ln_strength", "exponent", "wind_x", "wind_y", "wind_z", "thinning", "gamma", "eddy", "sway", "offset", "drift", "u_a", "rms",
))  # fmt: skip
LAGS = ("tau_rise", "tau_fall")
_LOOKS_LIKE_ONE = frozenset(("value", "u", "unit"))
_EXAMPLE = "Give the calibration.yaml of a run, or its folder, e.g. outputs/2026-01-31/12-00-00."


@dataclass(frozen=True, eq=False)
class CalibrationEntries:
    """A calibration file: quantities by dotted key in the order of the file, and `facts`, its categorical entries by name.

    `document` is the whole file as plain data, for what has no uncertainty of its own.
    """

    name: str
    quantities: Mapping[str, Quantity]
    facts: Mapping[str, str]
    document: Mapping[str, Any]

    def need(self, key: str) -> Quantity:
        """Return a quantity by its key; raises BadInput if the file does not have it."""
        if key not in self.quantities:
            raise BadInput(f"{self.name}: {key} is missing. {_EXAMPLE}")
        return self.quantities[key]

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints, from the base."""
        return tuple(self.document["arm"])

    @property
    def elements(self) -> int:
        """Number of sensor elements."""
        return sum(str(key).startswith("element_") for key in self.document["sensor"])


def read_calibration(path: Path) -> CalibrationEntries:
    """Read calibration.yaml, that of a run folder, or that attached to a log. Raises BadInput with the full key of what is wrong."""
    run = path if path.is_dir() else path.parent
    file = path / "calibration.yaml" if path.is_dir() else path
    if file.suffix == ".mcap":
        return calibration_entries(read_attachment(file, "calibration.yaml").decode(), str(path), _choices(file))
    if not file.is_file():
        raise BadInput(f"{file} was given as a calibration, but there is no such file. {_EXAMPLE}")
    try:
        text = file.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        raise BadInput(f"{file} was given as a calibration, but it is no text. {_EXAMPLE}") from None
    return calibration_entries(text, str(path), _choices(run / "run.mcap") if file.name == "calibration.yaml" else {})


def calibration_entries(text: str, name: str, choices: Mapping[str, str] | None = None) -> CalibrationEntries:
    """Return the entries of a file given as text; `name` is what errors call it, `choices` are facts known from elsewhere."""
    document = _document(text, name)
    found = {quantity.key: quantity for section in SECTIONS for quantity in _quantities(document.get(section), section, name)}
    return CalibrationEntries(name, found, {**(choices or {}), **_facts(document)}, document)


def _choices(log: Path) -> dict[str, str]:
    """What the log of the run knows beside the file: the names of sensor and profile; nothing if there is no log that can be read."""
    with contextlib.suppress(BadInput):
        known = read_metadata(log)
        return {key: known[key] for key in ("sensor", "profile") if key in known}
    return {}


def _document(text: str, name: str) -> dict[str, Any]:
    document = plain_yaml(text, name, _EXAMPLE)
    if not isinstance(document, dict) or document.get("schema") != SCHEMA:
        given = document.get("schema", "none") if isinstance(document, dict) else "none"
        raise BadInput(f"{name} has schema {given}, but a calibration has schema {SCHEMA}. {_EXAMPLE}")
    if strange := next(_built(document), None):
        raise BadInput(f"{name} has the key {strange}, but a calibration is numbers and words: nothing in it is ever built. {_EXAMPLE}")
    for section in REQUIRED:
        if not isinstance(document.get(section), dict) or not document[section]:
            raise BadInput(f"{name}: section '{section}' is {shown(document.get(section))}, but it must hold quantities. {_EXAMPLE}")
    return document


def _built(node: object) -> Iterator[str]:
    """Keys by which Hydra would build an object, at any depth."""
    if isinstance(node, dict):
        yield from (str(key) for key in node if str(key).startswith("_"))
    for inner in node.values() if isinstance(node, dict) else node if isinstance(node, list) else ():
        yield from _built(inner)


def _quantities(node: object, key: str, name: str) -> Iterator[Quantity]:
    if isinstance(node, dict) and (_LOOKS_LIKE_ONE & node.keys() or key.rsplit(".", 1)[-1] in QUANTITIES):
        found = read_quantity(node, key, name)
        if key.rsplit(".", 1)[-1] in LAGS and (found.unit != "s" or found.value <= 0.0):
            raise BadInput(f"{name}: {key} is {found.value:g} {found.unit}, but a lag is more than 0, in s. {_EXAMPLE}")
        yield found
    elif isinstance(node, dict):
        for inner, below in node.items():
            yield from _quantities(below, f"{key}.{inner}", name)
    elif isinstance(node, list) and key == "type_a":
        for rung in node:
            yield from _quantities(rung, f"{key}.rung_{rung.get('rung')}" if isinstance(rung, dict) else key, name)
    elif key.rsplit(".", 1)[-1] in QUANTITIES:
        raise BadInput(f"{name}: {key} is {shown(node)}, but a quantity has value, u and unit, e.g. {{value: 1.2, u: 0.1, unit: ppm}}.")


def _facts(document: Mapping[str, Any]) -> dict[str, str]:
    filter_, held = document.get("filter"), document.get("holds_for")
    joints = [str(joint) for joint in document["arm"]]
    facts = {
        **({name: held.get(name) for name in HOLDS_FOR} if isinstance(held, dict) else {}),
        "air form": document["range_law"].get("air"),
        "assembly": filter_.get("assembly") if isinstance(filter_, dict) else None,
        "elements": sum(str(key).startswith("element_") for key in document["sensor"]),
        "dof": len(joints),
        "joints": ", ".join(joints),
    }
    return {key: str(fact) for key, fact in facts.items() if fact is not None}
