"""Every example runs as it stands, prints what the page about it shows, and stands on that page in full."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.long

ROOT = Path(__file__).resolve().parents[1]
PAGE = (ROOT / "docs" / "how-to" / "python.md").read_text(encoding="utf-8")
BLOCK = re.compile(r"^```(\w*)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))


def lines(text):
    """Code without what makes it a notebook, and without empty lines."""
    return [line for line in text.splitlines() if line.strip() and not line.startswith("#")]


def test_there_are_examples():
    assert [path.stem for path in EXAMPLES] == ["streaming", "ten_lines"]


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_prints_what_the_page_shows(path, tmp_path):
    said = subprocess.run(
        [sys.executable, path], cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(ROOT)}, capture_output=True, text=True, check=False
    )
    assert said.returncode == 0 and said.stderr == "", said.stderr
    blocks = BLOCK.findall(PAGE)
    here = [i for i, (kind, text) in enumerate(blocks) if kind == "python" and lines(text) == lines(path.read_text(encoding="utf-8"))]
    assert len(here) == 1, f"docs/how-to/python.md must show {path.name} as it is"
    kind, shown = blocks[here[0] + 1]
    assert kind == "text" and shown == said.stdout


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_is_a_notebook_in_cells(path):
    text = path.read_text(encoding="utf-8")
    assert text.startswith("# %% [markdown]\n# # ") and text.count("\n# %%") >= 2
