"""One quantity of a calibration file: value, standard uncertainty, unit and degrees of freedom, each checked."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from oio.core.errors import BadInput

_LARGEST = 1e100  # its square is finite, too


@dataclass(frozen=True, slots=True)
class Quantity:
    """One quantity: value and standard uncertainty u >= 0 in `unit`; dof: degrees of freedom of u, infinite where u is taken as known."""

    key: str
    value: float
    u: float
    unit: str
    dof: float


def read_quantity(node: Mapping[str, Any], key: str, name: str) -> Quantity:
    """Return the quantity that a mapping of a file describes; raises BadInput with its full key. `name` is what errors call the file."""
    unit = node.get("unit")
    if not isinstance(unit, str) or not unit:
        raise BadInput(f"{name}: {key}.unit is {shown(unit)}, but a quantity has a unit as text, e.g. ppm, or '1' for a plain number.")
    u, dof = _number(node.get("u"), f"{key}.u", name, "0 or more"), node.get("dof")
    known = math.inf if dof is None else _number(dof, f"{key}.dof", name, "0 or more, or null if u is taken as known")
    return Quantity(key, _number(node.get("value"), f"{key}.value", name, ""), u, unit, known)


def _number(given: object, key: str, name: str, bound: str) -> float:
    """A finite number; with a `bound` in words it is also not negative."""
    allowed = f"a finite number{', ' if bound else ''}{bound}"
    number = given if isinstance(given, int | float) and not isinstance(given, bool) else math.nan
    if not -_LARGEST <= number <= _LARGEST or (bound and number < 0):
        raise BadInput(f"{name}: {key} is {shown(given)}, but it must be {allowed}.")
    return float(number)


def shown(given: object) -> str:
    """A value of a file in an error: `missing`, or as Python writes it, cut."""
    return "missing" if given is None else f"{given!r:.60}"
