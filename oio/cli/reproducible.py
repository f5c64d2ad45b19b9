"""Whether a run may be called reproducible: its code is a commit, its packages are the lock's, its devices said who they are."""

import dataclasses
import json
from collections.abc import Mapping

from oio.cli import git_state, lock_file
from oio.core.interfaces import World
from oio.results.summary import Reproducible

SHOWN = 3  # names in a reason


def reproducible(devices: Mapping[str, str | None]) -> Reproducible:
    """Judge this process and the devices of its world (what each said of itself, None: nothing): the same for the same tree."""
    reasons = (*_of_code(), *_of_packages(), *_of_devices(devices))
    return Reproducible("no" if reasons else "yes", reasons)


def provenance(devices: Mapping[str, str | None]) -> dict[str, str]:
    """Return what the log's metadata say of it: the devices in their own words, and the judgement."""
    return {"devices": json.dumps(dict(devices)), "reproducible": json.dumps(dataclasses.asdict(reproducible(devices)))}


def devices_of(world: World) -> Mapping[str, str | None]:
    """Return what the devices of a live world said of themselves, by configuration key; other worlds have none."""
    told = getattr(world, "identities", {})
    assert isinstance(told, Mapping)
    return told


def _of_code() -> tuple[str, ...]:
    if not git_state.in_git():
        return ("the code is in no git tree, so no commit names it",)
    changed = git_state.uncommitted()
    return (f"the git tree has changes that are not committed: {_some(changed)}",) if changed else ()


def _of_packages() -> tuple[str, ...]:
    differing = lock_file.differing()
    if differing is None:
        return ("there is no requirements.lock beside the code",)
    return (f"packages are not those of requirements.lock: {_some(differing)}",) if differing else ()


def _of_devices(devices: Mapping[str, str | None]) -> tuple[str, ...]:
    return tuple(f"{key} said nothing of itself" for key, identity in devices.items() if not identity)


def _some(names: tuple[str, ...]) -> str:
    more = len(names) - SHOWN
    return "; ".join(names[:SHOWN]) + (f"; and {more} more" if more > 0 else "")
