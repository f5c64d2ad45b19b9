"""The commands of README.md and docs/how-to/ that need hardware: every key exists, and all but the ports can be built."""

import re
import shlex
from pathlib import Path

import hydra
import pytest
from hydra.utils import instantiate

from hardware.backends.serial_port import SerialPort
from oio.core.folders import CONF
from oio.kinematics.homing import Homing

ROOT = Path(__file__).resolve().parents[2]
PAGES = (ROOT / "README.md", *sorted((ROOT / "docs" / "how-to").glob("*.md")))


def commands():
    for page in PAGES:
        text = page.read_text(encoding="utf-8").replace("\\\n", " ")
        for language, block in re.findall(r"^```(\w*)\n(.*?)^```$", text, re.DOTALL | re.MULTILINE):
            for line in block.splitlines():
                if language in ("", "sh") and line.startswith("python -m oio.run backend=serial"):
                    yield page.stem, shlex.split(line, comments=True)[3:]


def test_there_are_such_commands():
    assert len(list(commands())) >= 3


@pytest.mark.parametrize("words", [words for _, words in commands()], ids=[page for page, _ in commands()])
def test_a_command_of_the_pages_builds_a_bench(words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Homing.nominal(5, 2048).write(tmp_path / "homing.json")
    with hydra.initialize_config_dir(str(CONF), version_base="1.3"):
        cfg = hydra.compose("config", words)
    bench = instantiate(cfg.backend)
    bench._refuse_emulator_settings()  # it names real ports, and what stands there goes with them
    stages = [instantiate(stage, _convert_="all") for stage in cfg.stage.values()]
    assert isinstance(bench, SerialPort) and stages
