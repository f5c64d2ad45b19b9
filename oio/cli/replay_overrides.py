"""Overrides that a log was made with, as data; those of a replay come first."""

import json
import re
from collections.abc import Collection
from pathlib import Path

from oio.cli.renamed_keys import modernised
from oio.log import read_metadata

# An override from a log is data: a plain word, number or list, or the path of a calibration; with a plus a choice is added.
PLAIN = re.compile(r"\+{0,2}[A-Za-z_][\w.]*=[\w\-.,+\[\] ]*|calibration=[\w\-./]+")
ANSWERS = "protocol.answers"
OF_ITS_OWN = ("backend", "recording", "view")  # groups of which a replay has its own
RECORDING = ("recording", "recording.warm_up_max_s", "recording.baseline_max_s")  # what stages know of a recording: their time-outs


def replayed(arguments: list[str]) -> list[str]:
    """For backend=replay: prepend the overrides with which the log was written, except those that the command line gives."""
    log = next((a.split("=", 1)[1] for a in arguments if a.startswith("backend.log=")), None)
    if "backend=replay" not in arguments or log is None:
        return arguments
    words = logged(Path(log), but=arguments, without=OF_ITS_OWN)
    return [*(word for word in words if not word.startswith("+")), *arguments]  # an experiment that is added may turn a run into a sweep


def logged(log: Path, but: Collection[str] = (), without: Collection[str] = ()) -> list[str]:
    """Return the plain overrides that a log was made with, but those whose keys are overridden again or in groups `without`."""
    given = {_key(word) for word in but}
    words = json.loads(read_metadata(log).get("overrides", "[]"))
    passed = [word for word in map(modernised, filter(_is_plain, words)) if _may_pass(_key(word), given, (*without, "hydra"))]
    return [*(word for word in passed if _key(word) != ANSWERS), *_answers(log, passed, given)]


def _answers(log: Path, words: Collection[str], given: Collection[str]) -> list[str]:
    """Let the log answer the protocol that it was made with: nobody is asked again."""
    if ANSWERS in given or "protocol" not in map(_key, words):
        return []
    return [f"{ANSWERS}={quoted(log.resolve())}"]


def quoted(path: Path) -> str:
    """Return a path as a value of an override."""
    return "'" + str(path).replace("'", "\\'") + "'"


def _is_plain(override: object) -> bool:
    return isinstance(override, str) and PLAIN.fullmatch(override) is not None


def _may_pass(key: str, given: Collection[str], without: Collection[str]) -> bool:
    if key in RECORDING:
        return key not in given
    return key not in given and key.split(".")[0] not in without and key[0] != "_" and "_target_" not in key


def _key(override: str) -> str:
    return override.split("=", 1)[0].lstrip("+")
