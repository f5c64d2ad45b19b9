"""Writes the column `allowed` of docs/glossary.md from the ranges that the classes declare: `python docs/ranges.py`; a test compares."""

import importlib
import re
from pathlib import Path

from oio.core.ranges import declared

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "glossary.md"
HEAD = "| key | term | unit | allowed | class | file |\n|---|---|---|---|---|---|"
ROW = re.compile(r"\| (`[^|]+`) \| ([^|]+) \| ([^|]+) \|(?: [^|]* \|)? (`\w+`) \| (`[^|]+`) \|")


def allowed(key: str, owner: str, file: str) -> str:
    """Cell of a key: the range of the field of its name in the class that reads it; a dash if that is no number."""
    if not file.endswith(".py"):
        return "-"
    made = getattr(importlib.import_module(file.removesuffix(".py").replace("/", ".")), owner, None)
    names = [name for name in reversed(key.split(".")) if isinstance(made, type) and hasattr(made, "__dataclass_fields__")]
    found = next((declared(made)[name] for name in names[:2] if made and name in declared(made)), None)
    return str(found) if found else "-"


def written(text: str) -> str:
    """The page with its column as declared; rows without one get it."""
    before, heading, keys = text.partition("\n## Keys of the configuration\n")
    keys = re.sub(r"\| key \| term \| unit \|(?: allowed \|)? class \| file \|\n(?:\|---)+\|", HEAD, keys)
    return before + heading + "\n".join(map(_row, keys.split("\n")))


def _row(line: str) -> str:
    found = ROW.fullmatch(line)
    if not found:
        return line
    key, term, unit, owner, file = found.groups()
    return f"| {key} | {term} | {unit} | {allowed(key.strip('`'), owner.strip('`'), file.strip('`'))} | {owner} | {file} |"


if __name__ == "__main__":
    PAGE.write_text(written(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
