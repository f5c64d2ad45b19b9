"""Every code block of the documentation is run: a page in an empty folder, its commands in order, long runs with few moves.

A block whose first line is a comment with a path is written to that file. Commands that need real hardware are composed and built in
tests/hardware/test_hardware_commands.py; the page that adds a sensor is followed to the letter in tests/test_add_a_sensor.py.
"""

import importlib.util
import os
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path
from types import MappingProxyType

import pytest
import yaml

ROOT = Path(__file__).resolve().parents[1]
PAGES = sorted([*ROOT.glob("*.md"), ROOT / "hardware" / "README.md", *(ROOT / "docs").rglob("*.md")])
BLOCK = re.compile(r"^```(\w*)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
FILE = re.compile(r"(?:# |<!-- )([\w./-]+\.\w+)(?: -->)?\n")
LANGUAGES = {"sh", "python", "yaml", "xml", "toml", "text"}  # text: what a program prints, or a drawing
FOLLOWED_ELSEWHERE = "add_a_sensor.md"
FEW = {
    "calibrate_bouts": ("stage.calibrate_bouts.moves_per_rung=2",),
    "map_beliefs": ("stage.map_beliefs.repeats=2", "stage.map_beliefs.budget_s=0"),
    "navigate": ("stage.navigate.max_moves=6",),
}
NOT_RUN = {"git", "sudo", "pre-commit", ".venv/bin/pre-commit"}  # they change the machine or the repository
ENDLESS = {
    "hardware.emulate",
    "hardware.home",
    "hardware.joints",
    "hardware.ports",
}  # wait for a person or for parts; their modules must be there


def blocks(page):
    return BLOCK.findall(page.read_text(encoding="utf-8"))


def commands(text):
    lines = text.replace("\\\n", " ").splitlines()
    return [words for line in lines if (words := shlex.split(line, comments=True))]


def named(page):
    return str(page.relative_to(ROOT))


RUN = [page for page in PAGES if page.name != FOLLOWED_ELSEWHERE and {kind for kind, _ in blocks(page)} - {"text"}]


def test_there_are_pages_and_every_block_says_what_it_is():
    assert len(PAGES) > 20 and len(RUN) > 10
    assert {kind for page in PAGES for kind, _ in blocks(page)} <= LANGUAGES
    for page in PAGES:  # none is indented, or closed in another way, and so overlooked
        assert page.read_text(encoding="utf-8").count("```") == 2 * len(blocks(page)), page


QUICK = (
    "README.md",
    "CONTRIBUTING.md",
    "add_a_stage.md",
    "hardware.md",
    "install.md",
    "python.md",
)  # the others: half a minute and more each


@pytest.mark.long
@pytest.mark.parametrize("page", [pytest.param(page, marks=[pytest.mark.slow] * (page.name not in QUICK)) for page in RUN], ids=named)
def test_every_block_of_a_page_runs(page, tmp_path):
    if page.name in ("recordings.md", "identify.md") and not (Path(os.environ.get("OIO_DATA", "data")) / "orebro3dsen").is_dir():
        pytest.skip("no recordings here: OIO_DATA names no folder that has them")
    for kind, text in blocks(page):
        file = FILE.match(text)
        if file and kind != "sh":
            path = tmp_path / file[1]
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text.removeprefix(file[0]) if kind == "xml" else text, encoding="utf-8")
        elif kind == "python":
            run([sys.executable, "-c", text], tmp_path)
        elif kind == "sh":
            for words in commands(text):
                follow(words, tmp_path)
        if kind == "yaml":
            yaml.safe_load(text)
        if kind == "toml":
            tomllib.loads(text)


def follow(words, folder):
    """Run one command as it stands, or a short form of it; an unknown one is an error."""
    if words[0] == "make":
        run(["make", "-n", *words[1:]], ROOT)
    elif words[:2] == ["python", "-m"]:
        module, *rest = words[2:]
        if module in ENDLESS:
            assert importlib.util.find_spec(module)
        elif "backend=serial" not in rest:
            words = short(module, rest)
            run([sys.executable, "-m", module, *words], folder, codes=(0,) if words == rest else (0, 3))  # few moves may find no place
    elif words[0] != "." and words[0] not in NOT_RUN:
        run(words, folder)


def short(module, words):
    if module == "oio.bench":
        one_seed = ["seeds=7000:7001"] if words[0] != "filters" else []
        few = [few for stage in FEW.values() for few in stage] if words[0] in ("accuracy", "worlds", "searches", "stereo") else []
        replaced = {"seeds", *(word.partition("=")[0] for word in few)}
        return [*(word for word in words if word.partition("=")[0] not in replaced), *one_seed, *few]
    if module != "oio.run" or {"--help", "--cfg"} & set(words):
        return words
    stages = next((word.removeprefix("stage=").strip("[]").split(",") for word in words if word.startswith("stage=")), list(FEW))
    report = [] if {"-m", "--multirun"} & set(words) or any("report=" in word for word in words) else ["report=false"]
    return [*words, *(few for stage in stages for few in FEW.get(stage, ())), *report]


def run(command, folder, environment=MappingProxyType({"COLUMNS": "100"}), codes=(0,)):
    done = subprocess.run(command, cwd=folder, env={**os.environ, **environment}, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode in codes, f"{shlex.join(map(str, command))}\n{done.stdout[-2000:]}\n{done.stderr[-4000:]}"
    return done.stdout


def load(path):
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


COMMANDS = load(ROOT / "docs" / "commands.py")
HELP = COMMANDS.shown(COMMANDS.PAGE.read_text(encoding="utf-8"))


def test_every_command_is_in_the_reference():
    headings = re.findall(r"^## ((?:oio|hardware)\.[\w.]+)$", COMMANDS.PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    assert headings == list(HELP) and len(headings) > 15
    assert [
        f"python -m {module}"
        for module in re.findall(r"^\| `python -m ([\w.]+)` \|", COMMANDS.PAGE.read_text(encoding="utf-8"), re.M)
        if module not in HELP
    ] == []


@pytest.mark.parametrize("module", sorted(HELP))
def test_the_help_in_the_reference_is_what_the_command_says(module):
    """`python docs/commands.py` writes it."""
    assert COMMANDS.help_of(module).splitlines() == HELP[module].splitlines()


def test_the_picture_of_the_architecture_is_that_of_the_imports():
    architecture = load(ROOT / "docs" / "architecture.py")
    assert architecture.PICTURE.read_text(encoding="utf-8") == architecture.svg(), "python docs/architecture.py draws it anew"


@pytest.mark.parametrize("page", PAGES, ids=named)
def test_files_and_pages_that_are_named_exist(page):
    text = page.read_text(encoding="utf-8")
    links = [link.split("#")[0] for link in re.findall(r"\]\(([^)\s]+)\)", text) if not link.startswith(("http", "#"))]
    assert [link for link in links if not (page.parent / link).exists()] == []
    if page.name == "CHANGELOG.md":
        return  # it tells of files that are gone
    files = set(re.findall(r"`((?:oio|hardware|pipelines|conf|docs|tests)/[\w./-]+\.\w+)`", text))
    made = {FILE.match(code)[1] for _, code in blocks(page) if FILE.match(code)}
    assert [file for file in sorted(files - made) if "NAME" not in file and "graphene" not in file and not (ROOT / file).exists()] == []


def shape(table):
    """The words of a table without its numbers, line ends, and of cold starts what a processor's rounding decides: whether they hit."""
    lines = [re.sub(r"\b(yes|no)\b", "-", line) if line.startswith("│ cold start") else line for line in table.split("\n")]
    return re.sub(r"\d+", "0", " ".join(lines)).split()


@pytest.mark.long
def test_the_table_of_the_readme_is_what_the_command_prints(tmp_path):
    """Rounding differs between processors, and the table with it: here the README's second number is that of portable arithmetic."""
    digests = load(ROOT / "tests" / "test_digest.py")
    if digests.recorded()["versions"] != digests.versions():
        pytest.skip("other versions of the libraries may round otherwise")
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    table, tutorial = (next(code for _, code in blocks(ROOT / page) if "cold start" in code) for page in ("README.md", "docs/tutorial.md"))
    words = [sys.executable, "-m", "oio.run", "sensor=ec", "dof=5"]
    printed = run(words, tmp_path, digests.PORTABLE | {"COLUMNS": "140"})
    assert shape(printed[printed.index("ec (paper)") : printed.index("log, calibration")]) == shape(f"{table}")
    assert table == tutorial
    (error_mm,) = re.findall(r"│ calibrated +│ +([\d.]+) │", printed)
    assert f"{error_mm} mm with AVX2 alone" in " ".join(text.split())
