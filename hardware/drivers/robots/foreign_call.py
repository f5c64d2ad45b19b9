"""Calls into code of others, and numbers from it: whatever it raises or returns becomes one sentence, or a reading that is missing."""

import traceback
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import numpy as np

from hardware.transport.port import NoAnswer, Unplugged
from oio.core.errors import OioError
from oio.core.records import Array

T = TypeVar("T")


def foreign_call(what: str, action: Callable[[], T]) -> T:
    """Return what `action` does; `what` names it in messages.

    An OSError (ConnectionError, TimeoutError) is a link that fails for a moment, and raises NoAnswer; any other exception raises OioError.
    """
    try:
        return action()
    except (OioError, NoAnswer, Unplugged):
        raise
    except OSError as error:
        raise NoAnswer(f"{what} raised {told(error)}") from error
    except (Exception, SystemExit) as error:
        raise OioError(f"{what} raised {told(error)}.") from error


def told(error: BaseException) -> str:
    """An exception in words: its kind, its text, and where it was raised."""
    frames = [frame for frame in traceback.extract_tb(error.__traceback__) if not _is_of_import(frame.filename)]
    place = f" ({Path(frames[-1].filename).name}, line {frames[-1].lineno})" if len(frames) > 1 else ""  # the first is ours
    text = " ".join(str(error).split()).rstrip(".")
    return f"{type(error).__name__}{f': {text}' if text else ''}{place}"


def _is_of_import(file: str) -> bool:
    return file.startswith("<") or Path(file).parent.name == "importlib"


def checked_joints(what: str, values: object, names: tuple[str, ...]) -> Array:
    """Return `values` as an array, one finite number for each joint. Raises OioError for anything else, naming `what` gave it."""
    try:
        read = np.array(values, dtype=float)
    except (TypeError, ValueError):
        raise OioError(f"{what} gave {str(values)[:80]}, but {len(names)} numbers are wanted: {', '.join(names)}.") from None
    if read.shape != (len(names),):
        given = f"{len(read)} numbers" if read.ndim == 1 else f"an array of shape {read.shape}"
        raise OioError(f"{what} gave {given}, but the arm has {len(names)} joints: {', '.join(names)}.")
    if not np.all(np.isfinite(read)):
        wrong = names[int(np.argmin(np.isfinite(read)))]
        raise OioError(f"{what} gave {read[names.index(wrong)]} for joint {wrong}, but finite numbers are wanted.")
    return read
