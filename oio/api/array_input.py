"""Arrays from another program, checked at the door: shape, finite numbers, order."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from oio.core.errors import BadInput
from oio.core.records import Array, nanoseconds

TIMES = "mM"  # numpy's kinds of dates and durations, which would be read as whole numbers of whatever unit they have
FARTHEST_M = 99.0  # of a nose, or a box, from the origin of its frame
LONGEST_S = 1e8  # three years; nanoseconds as whole numbers and as floating-point seconds agree far beyond


def expected(name: str, value: object, kind: type, example: str, optional: bool = False) -> None:
    """Raise BadInput for a value of another type; `example`: what to give."""
    if not isinstance(value, kind) and not (optional and value is None):
        raise BadInput(f"{name} is a {type(value).__name__}, but a {kind.__name__} is wanted. Give e.g. {example}.")


def number(name: str, value: object) -> float:
    """Return one number, NaN and infinity among them. Raises BadInput for anything else."""
    if isinstance(value, bool | str) or np.ndim(value) != 0:  # type: ignore[arg-type]
        raise BadInput(f"{name} is {str(value)[:60]}, but one number is wanted.")
    try:
        return float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        raise BadInput(f"{name} is {str(value)[:60]}, but one number is wanted.") from None


def vector(name: str, values: ArrayLike, length: int | None = None) -> Array:
    """Return finite numbers (m,), m >= 1, read-only; raises BadInput for anything else, with what was given and wanted."""
    return _checked(name, values, ("m" if length is None else length,))


def matrix(name: str, values: ArrayLike, rows: int, columns: int | None = None) -> Array:
    """Return finite numbers (rows, columns), read-only; any number of columns if None."""
    return _checked(name, values, (rows, "n" if columns is None else columns))


def _checked(name: str, values: ArrayLike, wanted: tuple[int | str, ...]) -> Array:
    shape = f"({', '.join(map(str, wanted))}{',' if len(wanted) == 1 else ''})"
    try:
        given = np.asanyarray(values)
    except (TypeError, ValueError) as error:
        raise BadInput(f"{name} cannot be read as an array of numbers ({error}), but the shape {shape} is wanted.") from None
    if masked := int(np.count_nonzero(np.ma.getmaskarray(given))):
        raise BadInput(f"{name} has {masked} masked values, but {shape} numbers are wanted. Leave them out of all arrays.")
    if given.dtype.kind in TIMES:
        raise BadInput(f"{name} has the type {given.dtype}, but numbers are wanted. Give seconds: (t - t[0]) / np.timedelta64(1, 's').")
    if given.dtype.kind == "b":
        raise BadInput(f"{name} holds True and False, but numbers are wanted. Give the values themselves, not a comparison of them.")
    if given.dtype.kind == "c":
        raise BadInput(f"{name} has complex numbers, but real ones are wanted. Give e.g. their absolute values.")
    try:
        array = np.array(given, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise BadInput(f"{name} cannot be read as an array of numbers ({error}), but the shape {shape} is wanted.") from None
    fits = len(array.shape) == len(wanted) and all(w == n for w, n in zip(wanted, array.shape, strict=True) if isinstance(w, int))
    if not fits:
        advice = " Give one row per time, e.g. with numpy's reshape." if "." in name else ""  # a field of readings or of a path
        raise BadInput(f"{name} has the shape {array.shape}, but {shape} is wanted.{advice}")
    if array.size == 0:
        raise BadInput(f"{name} is empty, its shape is {array.shape}, but at least one value is wanted. Give what was recorded.")
    bad = np.flatnonzero(~np.isfinite(array).reshape(len(array), -1).all(axis=1))
    if len(bad):
        advice = " Leave these rows out of all arrays, e.g. with numpy's isfinite." if "." in name else " Give finite numbers."
        raise BadInput(f"{name} has {len(bad)} of {len(array)} rows that are no finite numbers, the first is row {bad[0]}.{advice}")
    array.setflags(write=False)
    return array


def times(name: str, values: ArrayLike, equal: bool = False) -> Array:
    """Return times (m,) s in ascending order, from 0 on; `equal`: neighbours may be equal."""
    t_s = vector(name, values)
    steps = np.diff(t_s)
    bad = np.flatnonzero(steps < 0.0 if equal else steps <= 0.0)
    if len(bad):
        i = int(bad[0])
        order = "must not decrease" if equal else "must increase"
        raise BadInput(
            f"{name} {order}, but {t_s[i + 1]:.6f} s in row {i + 1} comes after {t_s[i]:.6f} s. Sort all arrays by time, leave out doubles."
        )
    if t_s[0] < 0.0 or t_s[-1] > LONGEST_S:
        given = f"{name} runs from {t_s[0]:g} to {t_s[-1]:g} s"
        raise BadInput(f"{given}, but 0 to {LONGEST_S:g} s is allowed. Subtract the time of the beginning from all times.")
    return t_s


def elements(name: str, values: ArrayLike, length: int) -> NDArray[np.int64]:
    """Return element indices (length,), each 0 or more; one number stands for all."""
    given = _checked(name, np.full(length, values) if np.ndim(values) == 0 else values, (length,))
    if np.any(given < 0) or np.any(given != np.rint(given)):
        raise BadInput(
            f"{name} has values such as {given[(given < 0) | (given != np.rint(given))][0]:g}, but element indices are 0, 1, ..."
        )
    index = given.astype(np.int64)
    index.setflags(write=False)
    return index


def span(name: str, values: Sequence[float]) -> tuple[float, float]:
    """Return the begin and end [s] of a span that has a length."""
    begin, end = vector(name, values, 2).tolist()
    if not begin < end:
        raise BadInput(f"{name} is ({begin:g}, {end:g}), but it must begin before it ends. Give (begin, end) in seconds.")
    return begin, end


def stamp(name: str, t_s: Any, last_ns: int) -> int:
    """Return one time as nanoseconds, not before the last one."""
    t = float(vector(name, [t_s])[0])
    if not last_ns <= nanoseconds(t) <= nanoseconds(LONGEST_S):
        raise BadInput(
            f"{name} is {t:.6f} s after {last_ns / 1e9:.6f} s, but times must not decrease, nor exceed {LONGEST_S:g} s. "
            f"Give samples in order."
        )
    return nanoseconds(t)
