"""Writes what `--help` prints into docs/reference/commands.md: `python docs/commands.py`; a test compares."""

import os
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "reference" / "commands.md"
SECTION = re.compile(r"^(## ((?:oio|hardware)\.[\w.]+)\n.*?^```text\n)(.*?)(^```$)", re.DOTALL | re.MULTILINE)


def help_of(module: str) -> str:
    """What `python -m MODULE --help` prints on a terminal of 100 columns, without spaces at the ends of lines."""
    command = [sys.executable, "-m", module, "--help"]
    printed = subprocess.run(command, cwd=ROOT, env={**os.environ, "COLUMNS": "100"}, capture_output=True, text=True, check=True).stdout
    return "\n".join(line.rstrip() for line in printed.strip().splitlines()) + "\n"


def shown(page: str) -> dict[str, str]:
    """The text under each module's heading, by module."""
    return {module: text for _, module, text, _ in SECTION.findall(page)}


def written(page: str) -> str:
    """The page with each command's help as it is printed now."""
    return SECTION.sub(lambda found: found[1] + help_of(found[2]) + found[4], page)


if __name__ == "__main__":
    PAGE.write_text(written(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
