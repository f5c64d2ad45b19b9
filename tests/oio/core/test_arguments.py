"""A mistake among a command's words ends with code 2 and one line, not with the usage."""

import importlib

import pytest

from oio.cli.command_table import COMMANDS

MODULES = {name: module for name, (module, _) in COMMANDS.items() if module.startswith("oio.")}
PARSED = ("compare", "doctor", "export", "figures", "identify", "inspect", "protocol", "recover", "report", "reproduce", "sweep", "view")


@pytest.mark.parametrize("name", PARSED)
def test_an_unknown_option(name, capsys):
    module = importlib.import_module(f"{MODULES[name]}.__main__" if name not in ("protocol", "recover") else MODULES[name])
    with pytest.raises(SystemExit) as ended:
        module.main(["--foo"])
    said = capsys.readouterr()
    assert ended.value.code == 2 and said.out == ""
    assert said.err.startswith("oio: ") and said.err.count("\n") == 1 and f"Type e.g. python -m {MODULES[name]} " in said.err


def test_an_unknown_command_of_a_sweep(capsys):
    with pytest.raises(SystemExit):
        importlib.import_module("oio.sweep.commands").main(["statsu", "outputs/sweep"])
    said = capsys.readouterr().err
    assert "invalid choice: 'statsu'" in said and "Type e.g. python -m oio.sweep status outputs/sweep; --help says more." in said
