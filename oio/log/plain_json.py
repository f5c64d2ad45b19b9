"""JSON serialisation of any stage result, readable by every JSON parser."""

import dataclasses
import json
import math
import re
from collections.abc import Mapping
from enum import Enum
from typing import Any

import numpy as np


def to_json(value: object) -> str:
    """Return `value` as JSON text; the same value gives the same text in every process."""
    return json.dumps(_plain(value), allow_nan=False)


def _plain(value: object) -> Any:
    match value:
        case Enum():
            return _plain(value.value)
        case None | bool() | int() | str():
            return value
        case float():
            return _number(float(value))
        case np.ndarray() | np.generic():
            return _plain(value.tolist())
        case Mapping():
            return {str(key): _plain(inner) for key, inner in value.items()}
        case list() | tuple():
            return [_plain(inner) for inner in value]
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {field.name: _plain(getattr(value, field.name)) for field in dataclasses.fields(value)}
    return re.sub(r" at 0x[0-9a-fA-F]+", "", repr(value))  # an address would make two equal runs differ


def _number(value: float) -> float | str | None:
    if math.isnan(value):
        return None  # JSON has no NaN; null is "no value"
    return value if math.isfinite(value) else repr(value)
