"""Errors of Hydra and OmegaConf as one paragraph each: what was given, what is allowed, what to type.

Where their exceptions carry the key or the choice as an attribute, that is used. Two of their texts have to be read, because the exceptions
carry nothing else: the key that could not be overridden, and the place where an object was built.
"""

import difflib
import re
from collections.abc import Sequence
from pathlib import Path

from hydra.errors import CompactHydraException, InstantiationException, MissingConfigException, OverrideParseException
from omegaconf.errors import ConfigKeyError, InterpolationKeyError, OmegaConfBaseException

from oio.cli.help import choices
from oio.cli.io_errors import io_error
from oio.cli.known_keys import nearest, owner
from oio.cli.renamed_keys import renamed
from oio.core.errors import BadInput, OioError

# Fields of backends and stages that are filled by interpolation of the root key of the same name.
SHARED = (
    "arm", "sensor", "air", "world", "beacon", "source", "seeds",
    "recording", "belief_map", "process_noise", "nominal", "stop", "safety", "ekf",
    "search", "range_law", "bout",
)  # fmt: skip
LAUNCHING: dict[str, dict[str, str]] = {  # choices of Hydra's own groups, and the extra that each needs
    "hydra/launcher": {"joblib": "", "basic": "", "dask": "", "submitit_local": "slurm", "submitit_slurm": "slurm"},
    "hydra/sweeper": {"basic": "", "optuna": "optuna"},
}
NO_WORD = "Config group override must be a string or a list."  # such as sensor=null: Hydra raises a plain ValueError
FOREIGN = (CompactHydraException, OmegaConfBaseException, InstantiationException)
LIST_KEYS = "`python -m oio.run --cfg job` prints every key, `--help` every choice."


def known_error(error: BaseException, conf: Path) -> OioError | None:
    """The error to show for an exception, or None if it is a bug. `conf` is the folder of the configuration."""
    for cause in _causes(error):
        if isinstance(cause, OioError):
            return cause if cause is error else type(cause)(_with_key(str(cause), str(error)))
    of_files = next(filter(None, map(io_error, _causes(error) if isinstance(error, FOREIGN) else [error])), None)
    if of_files is not None:
        return of_files
    if isinstance(error, FOREIGN):
        return BadInput(_paragraph(error, conf))
    if isinstance(error, ValueError) and str(error).startswith(NO_WORD):
        given = str(error).split()[-1].replace("NoneType", "null")
        return BadInput(f"{given} was given where a choice is a word, or a list of words. Leave it out for none. {LIST_KEYS}")
    return None


def _causes(error: BaseException) -> list[BaseException]:
    """The exception and those behind it."""
    found, cause = list[BaseException](), error
    while cause is not None and cause not in found:
        found.append(cause)
        cause = cause.__cause__ or cause.__context__  # type: ignore[assignment]
    return found


def _paragraph(error: BaseException, conf: Path) -> str:
    text = " ".join(str(error).split())
    for cause in _causes(error):
        if isinstance(cause, MissingConfigException) and cause.missing_cfg_file:
            group, _, name = str(cause.missing_cfg_file).rpartition("/")
            return _no_such_choice(group, name, cause.options or [choice for choice, _ in choices(conf, group)])
        if isinstance(cause, OverrideParseException):
            example = "sensor=ec dof=5; quote lists: 'source.position=[0.3,0.1,0.15]'"
            return f"the command line could not be read: {text} Type KEY=VALUE words, e.g. {example}."
        if isinstance(cause, InterpolationKeyError):
            return _dangling(str(cause).split("'")[1], conf)
        if isinstance(cause, TypeError) and isinstance(error, InstantiationException):
            return _wrong_keys(str(cause), _root_key(_built_at(text)), conf)
    typed = re.search(r"Could not override '([^']+)'", text)
    keyed = next((cause for cause in _causes(error) if isinstance(cause, AttributeError | ConfigKeyError)), None)
    key = typed[1] if typed else getattr(keyed, "full_key", None)
    return _unknown_key(key, conf) if key else f"{text} {LIST_KEYS}"


def _unknown_key(key: str, conf: Path) -> str:
    if key == "stage":
        known = ",".join(name for name, _ in choices(conf, "stage"))
        return f"stage= takes a list of at least one of {known}. Type e.g. stage=[warm_up,baseline]."
    if new := renamed(key):
        return _renamed(key, new)
    if choice := owner(key, conf):
        group = key.split(".")[0]
        chosen = f"stage=[...,{choice}]" if group == "stage" else f"{group}={choice}"
        return f"'{key}' is a key of {chosen} only. Type {chosen} {key}=VALUE."
    return f"'{key}' is not a key of the configuration.{_nearest(key, conf)} {LIST_KEYS}"


def _nearest(key: str, conf: Path) -> str:
    """A sentence on the key that was probably meant; empty if none is like it."""
    near = nearest(key, conf)
    if near == key:
        group = key.split(".")[0]
        return f" Another choice of {group} has it: choose one, {group}=NAME. Several are a sweep: -m {group}=NAME,NAME."
    return f" The nearest is '{near}': type {near}=VALUE." if near else ""


def _wrong_keys(text: str, where: str, conf: Path) -> str:
    """Python's words for arguments of a class: keys of a YAML that it does not know, or that it lacks."""
    unexpected = re.search(r"unexpected keyword argument '(\w+)'", text)
    if unexpected:
        key = f"{where}.{unexpected[1]}" if where else unexpected[1]
        new = renamed(key)
        return _renamed(key, new) if new else f"'{key}' is not a key of its YAML.{_nearest(key, conf)} {LIST_KEYS}"
    absent = re.search(r"missing \d+ required keyword-only arguments?: (.+)", text)
    if absent:
        return f"{where} has no value for {absent[1]}. Give one on the command line or in its YAML."
    return f"{where} cannot be built: {text}. {LIST_KEYS}"


def _renamed(old: str, new: str) -> str:
    return f"'{old}' is now called '{new}'. Type {new}=VALUE."


def _no_such_choice(group: str, name: str, known: Sequence[str]) -> str:
    if group in LAUNCHING:
        return _no_such_plugin(group, name)
    if not group:
        return f"--config-name {name} was given, but OIO has one configuration. Leave it out, and choose by KEY=VALUE words."
    if not known:
        return f"'{group}={name}' was given, but there is no group '{group}'. `python -m oio.run --help` lists the choices."
    near = (difflib.get_close_matches(name, known, 1) or known)[0]
    example = f"{group}=[{near}]" if group == "stage" else f"{group}={near}"
    return f"{group}={name} was given, but {group} can be {', '.join(known)}. Type e.g. {example}."


def _no_such_plugin(group: str, name: str) -> str:
    """Hydra's launchers and sweepers come from packages, some of which are optional."""
    extra = LAUNCHING[group].get(name)
    if extra:
        return f"{group}={name} needs a package that is not installed. Type: pip install 'oio[{extra}]'"
    return f"{group}={name} was given, but {group} can be {', '.join(LAUNCHING[group])}. Type e.g. {group}={next(iter(LAUNCHING[group]))}."


def _dangling(key: str, conf: Path) -> str:
    group = key.split(".")[0]
    known = [choice for choice, _ in choices(conf, group)]
    if known:
        return f"'{key}' is used, but nothing gives it. Choose {group}=, one of {', '.join(known)}. Type e.g. {group}={known[0]}."
    return f"'{key}' is used, but nothing gives it. `python -m oio.run --cfg job` prints every key."


def _with_key(text: str, hydra_text: str) -> str:
    """Names the YAML key instead of the class: `Filament.wind_m_s` becomes `air.wind_m_s` when it was built for `backend.air`."""
    where = _built_at(hydra_text)
    return re.sub(r"^[A-Z]\w+\.", f"{_root_key(where)}.", text) if where else text


def _root_key(full_key: str) -> str:
    """The key as one types it: what backends and stages are given by interpolation stands at the root of the configuration."""
    parts = full_key.split(".")
    inner = parts[1:] if parts[0] == "backend" else parts[2:] if parts[0] == "stage" else []
    return ".".join(inner) if inner and inner[0] in SHARED else full_key


def _built_at(hydra_text: str) -> str:
    """The key of the node that Hydra was building; empty where the text names none."""
    found = re.search(r"full_key: (\S+)", hydra_text)
    return found[1] if found else ""
