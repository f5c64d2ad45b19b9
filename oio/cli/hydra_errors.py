"""What Hydra and OmegaConf say, as one paragraph: what was given, what is allowed, what to type."""

import re
from pathlib import Path

from hydra.errors import CompactHydraException, InstantiationException
from omegaconf.errors import OmegaConfBaseException

from oio.cli.help import choices
from oio.cli.renamed_keys import renamed
from oio.core.errors import BadInput, OioError

# Fields of backends and stages that are filled by interpolation of the root key of the same name.
SHARED = (
    "arm", "sensor", "air", "beacon", "source", "seeds", "recording", "belief_map", "process_noise", "nominal", "stop", "safety", "ekf",
    "search", "range_law", "bout",
)  # fmt: skip
FOREIGN = (CompactHydraException, OmegaConfBaseException, InstantiationException)


def known_error(error: BaseException, conf: Path) -> OioError | None:
    """The known error behind an exception, or None if it is a bug."""
    cause: BaseException | None = error
    while cause is not None:
        if isinstance(cause, OioError):
            return cause if cause is error else type(cause)(_with_key(str(cause), str(error)))
        cause = cause.__cause__ or cause.__context__
    if isinstance(error, FOREIGN):
        return BadInput(_paragraph(error, conf))
    return None


def _paragraph(error: BaseException, conf: Path) -> str:
    text = " ".join(str(error).split())
    group = re.search(r"Could not find '(\w+)/([^']+)'", text) or re.search(r"[Cc]ould not (?:load|find) '?(\w+)/([\w.-]+)'?", text)
    if group:
        return _no_such_choice(group[1], group[2], conf)
    if "Could not override 'stage'" in text or "Key 'stage' is not in struct" in text:
        known = ",".join(name for name, _ in choices(conf, "stage"))
        return f"stage= takes a list of at least one of {known}. Type e.g. stage=[warm_up,baseline]."
    unknown = re.search(r"Could not override '([^']+)'", text) or re.search(r"Key '(\w+)' is not in struct", text)
    if unknown and (new := renamed(unknown[1])):
        return _renamed(unknown[1], new)
    if unknown and (owner := _owner(unknown[1], conf)):
        chosen = f"{unknown[1].split('.')[0]}={owner}"
        return f"'{unknown[1]}' is a key of {chosen} only. Type {chosen} {unknown[1]}=VALUE."
    if unknown:
        return f"'{unknown[1]}' is not a key of the configuration. {_list_keys()} To add a new one on purpose: +{unknown[1]}=VALUE."
    unexpected = re.search(r"unexpected keyword argument '(\w+)'", text)
    if unexpected and (new := renamed(f"{_where(text)}{unexpected[1]}")):
        return _renamed(f"{_where(text)}{unexpected[1]}", new)
    if unexpected:
        return f"'{_where(text)}{unexpected[1]}' is not a key of its YAML. {_list_keys()}"
    absent = re.search(r"missing \d+ required keyword-only arguments?: (.+?)['\"]?\)", text)
    if absent:
        return f"{_where(text).rstrip('.')} has no value for {absent[1]}. Give one on the command line or in its YAML."
    interpolation = re.search(r"Interpolation key '([^']+)' not found", text)
    if interpolation:
        return _dangling(interpolation[1], conf)
    if "mismatched input" in text or "no viable alternative" in text or "extraneous input" in text or "missing EQUAL" in text:
        example = "sensor=ec dof=5; quote lists: 'source.position=[0.3,0.1,0.15]'"
        return f"the command line could not be read: {text} Type KEY=VALUE words, e.g. {example}."
    return f"{text} `python -m oio.run --help` lists the choices; `--cfg job` prints every key."


def _renamed(old: str, new: str) -> str:
    return f"'{old}' is now called '{new}'. Type {new}=VALUE."


def _no_such_choice(group: str, name: str, conf: Path) -> str:
    known = [choice for choice, _ in choices(conf, group)]
    if not known:
        return f"'{group}={name}' was given, but there is no group '{group}'. `python -m oio.run --help` lists the choices."
    example = f"{group}=[{known[0]}]" if group == "stage" else f"{group}={known[0]}"
    return f"{group}={name} was given, but {group} can be {', '.join(known)}. Type e.g. {example}."


def _dangling(key: str, conf: Path) -> str:
    group = key.split(".")[0]
    known = [choice for choice, _ in choices(conf, group)]
    if known:
        return f"'{key}' is used, but nothing gives it. Choose {group}=, one of {', '.join(known)}. Type e.g. {group}={known[0]}."
    return f"'{key}' is used, but nothing gives it. `python -m oio.run --cfg job` prints every key."


def _with_key(text: str, hydra_says: str) -> str:
    """Names the YAML key instead of the class: `Filament.wind_m_s` becomes `air.wind_m_s` when it was built for `backend.air`."""
    where = re.search(r"full_key: (\S+)", hydra_says)
    return re.sub(r"^[A-Z]\w+\.", f"{_typed(where[1])}.", text) if where else text


def _typed(full_key: str) -> str:
    """The key as one types it: what a backend or a stage is given by interpolation stands elsewhere in the configuration."""
    parts = full_key.split(".")
    inner = parts[1:] if parts[0] == "backend" else parts[2:] if parts[0] == "stage" else []
    return ".".join(inner) if inner and inner[0] in SHARED else full_key


def _owner(key: str, conf: Path) -> str | None:
    """The choice of a group in whose YAML the key stands, e.g. `replay` for backend.log."""
    group, _, rest = key.partition(".")
    for path in sorted((conf / group).glob("*.yaml")):
        if rest and re.search(rf"^{re.escape(rest.split('.')[0])}:", path.read_text(encoding="utf-8"), re.MULTILINE):
            return path.stem
    return None


def _where(text: str) -> str:
    found = re.search(r"full_key: (\S+)", text)
    return f"{found[1]}." if found else ""


def _list_keys() -> str:
    return "`python -m oio.run --cfg job` prints every key, `--help` every choice."
