"""Overrides of a replay: those of the log come first, as data."""

import json
import re
from pathlib import Path

from oio.cli.renamed_keys import modernised
from oio.log import read_metadata

PLAIN = re.compile(r"[A-Za-z_][\w.]*=[\w\-.,+\[\] ]*")  # an override from a log is data: a plain word, number or list, nothing else


def replayed(arguments: list[str]) -> list[str]:
    """For backend=replay: prepend the overrides with which the log was written, except those that the command line gives."""
    log = next((a.split("=", 1)[1] for a in arguments if a.startswith("backend.log=")), None)
    if "backend=replay" not in arguments or log is None:
        return arguments
    given = {a.split("=", 1)[0] for a in arguments}
    logged = json.loads(read_metadata(Path(log)).get("overrides", "[]"))
    return [*(a for a in map(modernised, filter(_is_plain, logged)) if _may_pass(a, given)), *arguments]


def _is_plain(override: object) -> bool:
    return isinstance(override, str) and PLAIN.fullmatch(override) is not None


def _may_pass(override: str, given: set[str]) -> bool:
    key = override.split("=", 1)[0]
    return (
        key not in given and key.split(".")[0] not in ("backend", "recording", "view", "hydra") and key[0] != "_" and "_target_" not in key
    )
