"""The object that `backend.arm.port=package.module:name` names: imported, made and looked at."""

import importlib
import os
import sys
from collections.abc import Callable
from typing import Any

from hardware.drivers.robots.foreign_call import foreign_call, told
from oio.core.errors import BadInput

METHODS = ("read", "write", "close")
EXAMPLE = "Type e.g. backend.arm.port=my_arm:Arm, for the class Arm in my_arm.py of this folder."


def load_user_object(key: str, target: str) -> Any:
    """Return what `target`, package.module:name, names; the current folder is searched last. Raises BadInput, naming `key`."""
    module_name, colon, name = target.partition(":")
    given = f"{key}={target} was given, but"
    if not (colon and name.isidentifier() and all(part.isidentifier() for part in module_name.split("."))):
        raise BadInput(f"{given} it must be package.module:name. {EXAMPLE}")
    module = _imported(given, module_name)
    if not hasattr(module, name):
        there = ", ".join(each for each in vars(module) if not each.startswith("_")) or "nothing"
        raise BadInput(f"{given} {module_name} has no {name}; it has {there}.")
    return getattr(module, name)


def _imported(given: str, name: str) -> Any:
    if os.getcwd() not in sys.path:
        sys.path.append(os.getcwd())
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError as error:
        if error.name is not None and (name == error.name or name.startswith(f"{error.name}.")):
            raise BadInput(f"{given} there is no module {error.name} in {os.getcwd()}, or on the path of Python. {EXAMPLE}") from None
        raise BadInput(f"{given} it cannot be imported: {told(error)}.") from error
    except (Exception, SystemExit) as error:
        raise BadInput(f"{given} it cannot be imported: {told(error)}.") from error


def made(target: str, loaded: Any) -> Any:
    """Return the arm: `loaded` itself, or what it makes. Raises OioError for one without the methods, NoAnswer for a link that fails."""
    has_methods = not isinstance(loaded, type) and hasattr(loaded, "read")
    factory: Callable[[], Any] | None = None if has_methods or not callable(loaded) else loaded
    arm = loaded if factory is None else foreign_call(f"{target}()", factory)
    missing = [name for name in METHODS if not callable(getattr(arm, name, None))]
    if missing:
        raise BadInput(
            f"backend.arm.port={target} is a {type(arm).__name__} without {', '.join(f'{name}()' for name in missing)}, but an arm needs "
            f"read() -> positions, write(positions) and close()."
        )
    return arm
