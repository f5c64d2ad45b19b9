"""`import oio` is light, and its names are those of the stub, of `__all__` and of the reference."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import oio

ROOT = Path(__file__).resolve().parents[3]


def test_import_loads_nothing_else():
    code = "import sys; before = set(sys.modules); import oio; print(*sorted(set(sys.modules) - before))"
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT).stdout.split()
    assert {name for name in said if name.startswith("oio")} == {"oio"}
    assert not {"numpy", "hydra", "mcap", "scipy", "numba"} & set(said)


def test_every_name_is_there_typed_and_in_the_reference():
    stub = ast.parse((ROOT / "oio" / "__init__.pyi").read_text(encoding="utf-8"))
    typed = {(alias.name, node.module) for node in stub.body if isinstance(node, ast.ImportFrom) for alias in node.names}
    assert typed == set(oio._HOMES.items())
    reference = (ROOT / "docs" / "reference" / "api.md").read_text(encoding="utf-8")
    for name, home in oio._HOMES.items():
        found = getattr(oio, name)
        assert found.__module__ == home and found.__doc__, name
        assert f"::: {home}.{name}\n" in reference, name
    assert set(dir(oio)) == set(oio.__all__) == {"__version__", *oio._HOMES}


def test_a_name_that_does_not_exist_is_answered_with_those_that_do():
    with pytest.raises(AttributeError, match="locate"):
        _ = oio.lokate
