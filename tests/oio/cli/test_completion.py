"""Tab completion of `oio`, as text and in the shells themselves where they are installed."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from oio.__main__ import main
from oio.cli.command_table import COMMANDS
from oio.cli.completion import SHELLS, completions
from oio.core.folders import CONF

ROOT = Path(__file__).resolve().parents[3]


@pytest.mark.parametrize(
    ("typed", "found"),
    [
        ("oio rep", ["report", "report=", "reproduce"]),
        ("oio sensor=mo", ["sensor=mox_mics", "sensor=mox_mq"]),
        ("oio run sensor=mo", ["sensor=mox_mics", "sensor=mox_mq"]),
        ("oio run -m sensor=ec,n", ["sensor=ec,ndir"]),
        ("oio run +experiment=table", ["+experiment=table_1"]),
        ("oio run stop.sd", ["stop.sd_m="]),
        ("oio run stage.navigate.max_m", ["stage.navigate.max_moves="]),
        ("oio run sto", ["stop."]),
        ("oio report out", []),  # files
        ("oio run calibration=out", []),
    ],
)
def test_what_may_follow(typed, found):
    assert completions(typed, CONF) == found


def test_every_command_is_offered_and_can_be_run():
    offered = completions("oio ", CONF)
    assert set(COMMANDS) < set(offered)
    for module, _ in COMMANDS.values():
        path = ROOT / module.replace(".", "/")
        assert path.with_suffix(".py").is_file() or (path / "__main__.py").is_file()


@pytest.fixture
def with_oio(tmp_path):
    """An environment in which `oio` is this checkout's."""
    script = tmp_path / "oio"
    script.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m oio "$@"\n')
    script.chmod(0o755)
    return {**os.environ, "PATH": f"{tmp_path}:{os.environ['PATH']}", "PYTHONPATH": str(ROOT), "HOME": str(tmp_path)}


TYPED = "oio run sensor=mo"
IN_SHELL = {
    "bash": (
        f'eval "$(oio completion bash)"; COMP_LINE="{TYPED}"; COMP_POINT=${{#COMP_LINE}}; _oio; echo "${{COMPREPLY[@]}}"',
        "mox_mics mox_mq",
    ),
    "zsh": (
        f'compdef() {{ }}; compadd() {{ shift 3; echo "$@" }}; eval "$(oio completion zsh)"; BUFFER="{TYPED}"; CURSOR=${{#BUFFER}}; _oio',
        "sensor=mox_mics sensor=mox_mq",
    ),
    "fish": (f"oio completion fish | source; complete -C '{TYPED}'", "sensor=mox_mics\nsensor=mox_mq"),
}


@pytest.mark.parametrize("shell", SHELLS)
def test_in_the_shell(with_oio, shell):
    if not shutil.which(shell):
        pytest.skip(f"no {shell} here")
    code, found = IN_SHELL[shell]
    done = subprocess.run([shell, "-c", code], env=with_oio, cwd=ROOT, capture_output=True, text=True, check=False, timeout=60)
    assert done.stdout.strip() == found, done.stderr


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["rnu"], "oio: 'rnu' is no command. Type oio run.\n"),
        (["xyzzy"], "oio: 'xyzzy' is no command. Type oio --help.\n"),
        (["completion", "tcsh"], "it can be bash, zsh, fish"),
    ],
)
def test_wrong_words(monkeypatch, capsys, words, says):
    monkeypatch.setattr(sys, "argv", ["oio", *words])
    assert main() == 2
    assert says in capsys.readouterr().err


def test_a_command_by_its_name(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["oio"])
    assert main() == 0
    told = capsys.readouterr().out
    assert all(f"\n  {name} " in told for name in COMMANDS)
    monkeypatch.setattr(sys, "argv", ["oio", "--version"])
    assert main() == 0 and capsys.readouterr().out.startswith("oio ")
    monkeypatch.setattr(sys, "argv", ["oio", ""])  # a variable of the shell that is empty
    assert main() == 2 and "'' is no command" in capsys.readouterr().err
    done = subprocess.run([sys.executable, "-m", "oio", "report", "nowhere"], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 2 and "nowhere" in done.stderr
