"""docs/glossary.md lists every configuration key that can be typed, and names no key, class or file that does not exist."""

import importlib.util
import re
from pathlib import Path

import pytest
import yaml
from omegaconf import OmegaConf

ROOT = Path(__file__).resolve().parents[1]
CONF = ROOT / "conf"
TEXT = (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8")
CHOSEN = {
    key
    for entry in yaml.safe_load((CONF / "config.yaml").read_text(encoding="utf-8"))["defaults"]
    if isinstance(entry, dict)
    for key in entry
}
CHOICES = [(group.name, path.stem) for group in sorted(CONF.iterdir()) if group.is_dir() for path in sorted(group.glob("*.yaml"))]
SENSORS = sorted(path.stem for path in (CONF / "sensor").glob("*.yaml"))


def rows(section):
    """Cells of the table rows of a section, without the heads."""
    text = TEXT.split(f"\n## {section}\n")[1].split("\n## ")[0]
    tables = re.findall(r"^\|.*\n\|(?:---\|)+\n((?:\|.*\n)+)", text, re.MULTILINE)
    return [tuple(cell.strip() for cell in line.strip("|").split("|")) for table in tables for line in table.splitlines()]


RANGED_ELSEWHERE = {
    "`seed`",
    "`trials`",
    "`table_1.SENSOR.time_s`",
    "`table_1.SENSOR.error_ppm`",
}  # build() checks seed and trials, the paper gives the others
SYMBOLS, TERMS, KEYS = rows("Symbols"), rows("Terms"), rows("Keys of the configuration")
NAMED = {name.replace("SENSOR", sensor) for name in (key.strip("`") for key, *_ in KEYS) for sensor in SENSORS}


def override(group, name):
    """What is typed to choose it: stages are a list, and groups without a default are added."""
    return f"stage=[{name}]" if group == "stage" else f"{'' if group in CHOSEN else '+'}{group}={name}"


def leaves(node, prefix=""):
    """Keys below a node with their values; a mapping by numbers, such as bout.window_by_dof, is a value."""
    for key, value in node.items():
        if key != "_target_" and isinstance(value, dict) and all(isinstance(inner, str) for inner in value):
            yield from leaves(value, f"{prefix}{key}.")
        elif key != "_target_":
            yield f"{prefix}{key}", value


@pytest.fixture(scope="module")
def configured(composed):
    """All leaf keys of all choices, and those of them that do not only pass on another key."""
    compositions = [OmegaConf.to_container(composed(override(*choice)), resolve=False) for choice in CHOICES]
    pairs = [pair for composition in compositions for pair in leaves(composition)]
    return {key for key, _ in pairs}, {key for key, value in pairs if not str(value).startswith("${")}


def test_every_key_is_listed(configured):
    assert configured[1] - NAMED == set()


def test_every_listed_key_exists(configured):
    assert NAMED - configured[0] == set()


def test_no_row_is_listed_twice():
    for table, columns in ((SYMBOLS, slice(0, 2)), (TERMS, slice(0, 1)), ([(row[0], row[4]) for row in KEYS], slice(0, 2))):
        assert table and len({row[columns] for row in table}) == len(table)


@pytest.mark.parametrize(("key", "owner", "file"), [(row[0], row[4], row[5]) for row in KEYS])
def test_the_class_of_a_key_is_in_its_file(key, owner, file):
    source = (ROOT / file.strip("`")).read_text(encoding="utf-8")
    leaf = key.strip("`").rsplit(".", 1)[-1]
    assert re.search(rf"^(class|def) {owner.strip('`')}\b", source, re.MULTILINE)
    assert re.search(rf"\b{leaf}\b", source)


def test_ranges_are_those_that_the_classes_declare():
    """`python docs/ranges.py` writes them."""
    spec = importlib.util.spec_from_file_location("ranges_page", ROOT / "docs" / "ranges.py")
    page = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(page)
    assert page.written(TEXT) == TEXT
    assert "| 1e-05 to 1 | `StopRule` |" in TEXT
    assert {row[0] for row in KEYS if row[2] != "-" and row[3] == "-"} == RANGED_ELSEWHERE


def test_every_file_exists():
    assert all(re.fullmatch(r"`[\w/]+\.\w+`", row[-1]) for row in (*SYMBOLS, *TERMS, *KEYS))
    files = set(re.findall(r"`([\w./-]+/[\w-]+\.\w+)`", TEXT))
    assert {file for file in files if not (ROOT / file).is_file()} == set()
