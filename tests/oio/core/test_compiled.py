"""Compiled code is never older than its sources, in whichever file they are."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from oio.core.compiled import KEPT_S, _forget_old, cache_folder, source_hash
from oio.core.folders import ROOT

# The readings that a grid search expects: compiled in one file, from the law of another.
PROGRAM = """
import numpy as np
from oio.inference.extension_kernel import LawScale
from oio.inference.forward_kernel import Lag
from oio.inference.grid_search import grid_costs
nose, at = np.linspace(0.0, 0.3, 12).reshape(4, 3), np.arange(4)
thetas = np.array([[0.4, 0.1, 0.2, 1.0, 1.2, 3.0, -1.0, 0.5, 0.3]])
law, lag = LawScale(0.1, 0.01), Lag(0.3, 0.4)
costs, _ = grid_costs(thetas, nose, np.full(4, 0.1), at, np.ones(4), 0.0, law, lag, np.zeros(4), np.arange(4.0), np.ones(4))
print(repr(float(costs[0])))
"""


def told(root, **env):
    """What the program says in a fresh process of its own."""
    clean = {key: value for key, value in os.environ.items() if key != "NUMBA_CACHE_DIR"}
    done = subprocess.run([sys.executable, "-c", PROGRAM], cwd=root, env={**clean, **env}, capture_output=True, text=True, check=True)
    return float(done.stdout)


def test_a_change_in_another_file_is_compiled_in(tmp_path):
    """numba's own cache, which looks at the file of the function alone, went on with the old law."""
    shutil.copytree(ROOT / "oio", tmp_path / "oio", ignore=shutil.ignore_patterns("__pycache__", ".numba_cache"))
    before = told(tmp_path)
    law = tmp_path / "oio" / "gas" / "range_law.py"
    changed = law.read_text(encoding="utf-8").replace("_SMOOTH_PER_M = 0.5", "_SMOOTH_PER_M = 2.5")
    assert changed != law.read_text(encoding="utf-8")
    law.write_text(changed, encoding="utf-8")
    plain = told(tmp_path, NUMBA_DISABLE_JIT="1")
    assert told(tmp_path) == pytest.approx(plain, rel=1e-12)
    assert plain != pytest.approx(before, rel=1e-3)


@pytest.mark.parametrize("name", ["oio/gas/range_law.py", "hardware/air/puffs.py", "oio/core/records.py"])
def test_the_hash_is_of_every_source(tmp_path, name):
    for folder in ("oio", "hardware"):
        shutil.copytree(ROOT / folder, tmp_path / folder, ignore=shutil.ignore_patterns("__pycache__"))
    assert source_hash(tmp_path) == source_hash(ROOT)
    source = tmp_path / name
    source.write_bytes(source.read_bytes() + b"\n")
    assert source_hash(tmp_path) != source_hash(ROOT)


def test_every_compiled_source_is_hashed():
    """A function that is compiled elsewhere would go on with old code."""
    files = [path for package in ("oio", "hardware", "pipelines") for path in (ROOT / package).rglob("*.py")]
    using = sorted(path for path in files if "import numba" in path.read_text(encoding="utf-8"))
    assert [path.relative_to(ROOT) for path in using] == [Path("oio/core/compiled.py"), Path("oio/core/shipped_code.py")]
    from oio.core.compiled import SOURCES

    decorated = [path for path in files if "@compiled" in path.read_text(encoding="utf-8") and path != using[0]]
    assert decorated and all(any(path.is_relative_to(ROOT / source) for source in SOURCES) for path in decorated)


def test_old_folders_are_forgotten_and_new_ones_kept(tmp_path):
    old, new, foreign = (tmp_path / name for name in ("0" * 16, "1" * 16, "mine"))
    for folder in (old, new, foreign):
        (folder / "inner").mkdir(parents=True)
        (folder / "inner" / "file.nbi").write_text("x")
    long_ago = new.stat().st_mtime - 2 * KEPT_S
    for folder in (old, foreign):
        os.utime(folder, (long_ago, long_ago))
    _forget_old(new)
    assert not old.exists() and (new / "inner" / "file.nbi").is_file() and foreign.is_dir()


def test_the_folder_is_named_by_the_sources():
    assert cache_folder().name == source_hash(ROOT)
