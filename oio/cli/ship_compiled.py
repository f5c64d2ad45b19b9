"""`python -m oio.cli.ship_compiled FOLDER`: compile for most processors, and pack the code into a folder for a wheel (see `make wheel`)."""

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from oio.cli.tool_args import run_tool
from oio.core import shipped_code
from oio.core.compiled import cache_folder
from oio.core.errors import BadInput
from oio.core.folders import ROOT

COMPILE = "from oio.cli.first_compile import first_compile; first_compile()"


def ship(into: Path) -> int:
    """Compile everything in a cache of its own and pack it below `into`; returns the number of files."""
    sources = cache_folder().name
    packed = into / shipped_code.name_of(sources)
    shutil.rmtree(packed, ignore_errors=True)
    with tempfile.TemporaryDirectory() as cache:
        env = {**os.environ, **shipped_code.BUILD, "NUMBA_CACHE_DIR": cache}
        subprocess.run([sys.executable, "-c", COMPILE], cwd=ROOT, env=env, check=True)
        return shipped_code.pack(Path(cache) / sources, packed)


def run(arguments: list[str]) -> None:
    """Run the command."""
    if len(arguments) != 1:
        raise BadInput(f"{len(arguments)} words were given, but this takes a folder. Type python -m oio.cli.ship_compiled build/compiled.")
    print(f"{ship(Path(arguments[0]))} files of compiled code in {arguments[0]}")  # noqa: T201


if __name__ == "__main__":
    raise SystemExit(run_tool(run, (__doc__ or "").strip()))
