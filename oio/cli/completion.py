"""Tab completion of `oio`: what may follow what was typed, and the lines that a shell needs. Loads neither Hydra nor numpy."""

from pathlib import Path

from oio.cli.command_table import COMMANDS
from oio.cli.help import GROUPS, choices
from oio.cli.known_keys import known_keys

BASH = r"""_oio() {
    local typed="${COMP_LINE:0:COMP_POINT}" IFS=$'\n'
    local word="${typed##*[[:space:]]}"
    local before="${word%"${word##*[=:]}"}"  # bash takes = and : for ends of a word
    COMPREPLY=($(oio --complete "$typed" 2>/dev/null))
    COMPREPLY=("${COMPREPLY[@]#"$before"}")
    [[ ${#COMPREPLY[@]} -eq 1 && ${COMPREPLY[0]} == *[=.,] ]] && compopt -o nospace 2>/dev/null
    return 0
}
complete -o default -F _oio oio
"""
ZSH = r"""_oio() {
    local -a found
    found=("${(@f)$(oio --complete "${BUFFER[1,CURSOR]}" 2>/dev/null)}")
    [[ -n "$found[1]" ]] && compadd -S '' -- $found || _files
}
compdef _oio oio
"""
FISH = "complete -c oio -a '(oio --complete (commandline -cp))'\n"
SHELLS = {"bash": BASH, "zsh": ZSH, "fish": FISH}
INSTALL = {
    "bash": 'eval "$(oio completion bash)"    in ~/.bashrc',
    "zsh": 'eval "$(oio completion zsh)"    in ~/.zshrc, after compinit',
    "fish": "oio completion fish | source    in ~/.config/fish/config.fish",
}


def completions(typed: str, conf: Path) -> list[str]:
    """Return whole words for the last word of a command line that is typed so far, e.g. `oio sens`; none where files are meant."""
    words = typed.split()[1:] + ([""] if typed[-1:].isspace() else [])
    word = words[-1] if words else ""
    found = [*_commands(words, word), *(_overrides(word, conf) if _of_run(words) else [])]
    return sorted(dict.fromkeys(found))


def _commands(words: list[str], word: str) -> list[str]:
    return [name for name in (*COMMANDS, "completion") if name.startswith(word)] if len(words) <= 1 else []


def _of_run(words: list[str]) -> bool:
    return not words or words[0] == "run" or words[0] not in COMMANDS


def _overrides(word: str, conf: Path) -> list[str]:
    sign = word[:1] if word[:1] in ("+", "~") else ""
    key, equals, value = word[len(sign) :].partition("=")
    if equals:
        listed, comma, last = value.rpartition(",")  # of a sweep
        names = [name for name, _ in choices(conf, key)] if key in GROUPS else []
        return [f"{sign}{key}={listed}{comma}{name}" for name in names if name.startswith(last)]
    return [f"{sign}{known}" for known in _to_next_dot(key, conf)]


def _to_next_dot(key: str, conf: Path) -> list[str]:
    """Keys that begin like this, each up to its next dot, as shells do with folders; a whole key ends in an equals sign."""
    groups = [*GROUPS] if "." not in key else []
    depth = key.count(".")
    found = [f"{group}=" for group in groups if group.startswith(key)]
    for known in known_keys(conf):
        parts = known.split(".")
        if known.startswith(key) and known not in GROUPS:
            found.append(f"{known}=" if len(parts) == depth + 1 else ".".join(parts[: depth + 1]) + ".")
    return found
