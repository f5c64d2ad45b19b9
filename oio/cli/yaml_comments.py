"""Keys of a YAML file with what is written beside them: the value as it stands there, the comment, and the class that reads it."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import yaml

from oio.core.errors import BadInput


@dataclass(frozen=True, slots=True)
class WrittenKey:
    """A key of a file: its value as it is written there (empty: keys below it), its comment, and of the class that reads it name and
    field (empty if none)."""

    key: str
    value: str
    comment: str
    owner: str = ""
    field: str = ""


def heading(path: Path) -> str:
    """Return the comment that heads a file."""
    lines = [line for line in _lines(path) if not line.startswith("# @package")]  # Hydra wants that on the first line
    ends = next((i for i, line in enumerate(lines) if not line.startswith("#")), len(lines))
    return " ".join(line.lstrip("# ").rstrip() for line in lines[:ends])


def bases(path: Path) -> tuple[str, ...]:
    """Return the choices of the same group that a choice is built on."""
    root = _root(path)
    listed = next((value for key, value in root.value if key.value == "defaults"), None) if root else None
    items = listed.value if isinstance(listed, yaml.SequenceNode) else ()
    return tuple(item.value for item in items if isinstance(item, yaml.ScalarNode) and item.value != "_self_")


def written_keys(path: Path) -> tuple[WrittenKey, ...]:
    """Return every key of a file that has a value or a comment, in the file's order. A comment goes on in the lines below it.

    Raises BadInput if it is no YAML.
    """
    root = _root(path)
    return tuple(_keys(root, _lines(path), "", "", "")) if root else ()


def _root(path: Path) -> yaml.MappingNode | None:
    try:
        root = yaml.compose(path.read_text(encoding="utf-8"), Loader=yaml.SafeLoader)
    except yaml.YAMLError as error:
        raise BadInput(f"{path} is no YAML: {' '.join(str(error).split())}. Mend it, or take it out of the folder.") from error
    return root if isinstance(root, yaml.MappingNode) else None


def _keys(node: yaml.MappingNode, lines: list[str], prefix: str, owner: str, field: str) -> Iterator[WrittenKey]:
    target = next((value.value for key, value in node.value if key.value == "_target_"), "")
    for key, value in node.value:
        name = f"{prefix}{key.value}"
        if key.value == "_target_" or (not prefix and key.value in ("defaults", "hydra")):
            continue
        reads, of = (target, key.value) if target else (owner, field)
        if isinstance(value, yaml.MappingNode) and value.value:
            if comment := _comment(value if value.flow_style else key, lines):
                yield WrittenKey(name, "", comment, reads, of)
            yield from _keys(value, lines, f"{name}.", reads, of)
        else:
            yield WrittenKey(name, _value(value, lines), _comment(value, lines), reads, of)


def _value(node: yaml.Node, lines: list[str]) -> str:
    """The value as it is written; a list of several lines in one, one of mappings as [...]."""
    begin, end = node.start_mark, node.end_mark
    if begin.line == end.line:
        return lines[begin.line][begin.column : end.column]
    if isinstance(node, yaml.SequenceNode):
        holds_keys = any(isinstance(item, yaml.MappingNode) for item in node.value)
        return "[...]" if holds_keys else f"[{', '.join(_value(item, lines) for item in node.value)}]"
    return str(node.value)


def _comment(node: yaml.Node, lines: list[str]) -> str:
    """What follows a value behind a number sign, on its line and on those below."""
    at = node.end_mark.line
    if at >= len(lines) or not lines[at][node.end_mark.column :].lstrip(" :,]}").startswith("#"):
        return ""
    parts = [lines[at][node.end_mark.column :].partition("#")[2]]
    for line in lines[at + 1 :]:
        if not line.lstrip().startswith("#") or _indent(line) <= _indent(lines[at]):
            break
        parts.append(line.lstrip(" #"))
    return " ".join(part.strip() for part in parts).rstrip(";,.")


def _indent(line: str) -> int:
    return len(line) - len(line.lstrip())


def _lines(path: Path) -> list[str]:
    return path.read_text(encoding="utf-8").splitlines()
