"""What a run needs to start is imported; what takes long to import and is for others is not."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
OTHERS = {"scipy.stats", "scipy.optimize", "matplotlib", "plotly", "joblib", "distributed", "pandas", "pyarrow", "rerun", "gymnasium"}
OTHERS |= {"glfw"}  # of MuJoCo's windows
PROGRAM = """
import runpy, sys
sys.argv = ["oio.run", "stage=[warm_up]", "report=false", "hydra.run.dir=" + sys.argv[1]]
try:
    runpy.run_module("oio.run", run_name="__main__")
except SystemExit as end:
    assert not end.code, end.code
print(*sys.modules)
"""


def test_a_run_leaves_out_what_others_need(tmp_path):
    line = [sys.executable, "-c", PROGRAM, str(tmp_path / "run")]
    done = subprocess.run(line, cwd=ROOT, capture_output=True, text=True, check=True)
    loaded = set(done.stdout.splitlines()[-1].split())
    assert {"mujoco", "numba", "hydra"} <= loaded
    assert not loaded & OTHERS
