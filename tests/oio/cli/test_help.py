"""`--help`: the choices of the project and of the user's own folder, without what takes a second to load."""

import subprocess
import sys
from pathlib import Path

import pytest

from oio.cli.help import asks_for_help, show_help_for

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture
def own(tmp_path):
    (tmp_path / "ekf").mkdir()
    (tmp_path / "ekf" / "mine.yaml").write_text("# A filter of my own.\n_target_: mine.Mine\n")
    return tmp_path


@pytest.mark.parametrize("form", ["--config-dir {}", "--config-dir={}", "-cd {}"])
def test_the_users_own_choices_are_among_them(own, capsys, form):
    words = ["--help", *form.format(own).split()]
    assert asks_for_help(words)
    show_help_for(words)
    said = capsys.readouterr().out
    assert "A filter of my own." in said and "Infrared carbon dioxide sensor" in said


def test_help_loads_no_physics_no_compiler_and_no_hydra():
    loaded = "print(sorted({'numba', 'mujoco', 'hydra', 'scipy'} & set(sys.modules)))"
    code = f"import sys; sys.argv[1:] = ['--help']; from oio import run; run.main(); {loaded}"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"
