"""The cache of compiled functions: without it every process compiles anew."""

import os
from pathlib import Path
from typing import Annotated

from oio.core.compiled import cache_folder
from oio.core.settings import Within, settings
from oio.doctor.finding import FAIL, PASS, WARN, Finding


@settings
class CompileCache:
    """How long it takes to fill the cache [s]."""

    compile_s: Annotated[float, Within(0, 3600)]

    def check(self) -> Finding:
        """FAIL if the cache cannot be written, WARN if it is cold."""
        return self.judge(cache_folder())

    def judge(self, folder: Path) -> Finding:
        """Judge the folder of the cache."""
        if not (folder.is_dir() and os.access(folder, os.W_OK | os.X_OK)):
            action = "Type export NUMBA_CACHE_DIR=FOLDER with one that you may write to."
            return Finding("compiled functions", FAIL, f"{folder} cannot be written to", action)
        kept = len(list(folder.rglob("*.nbc")))
        if not kept:
            action = f"Nothing: the first run compiles for about {self.compile_s:g} s, later ones do not."
            return Finding("compiled functions", WARN, f"{folder} is cold", action)
        return Finding("compiled functions", PASS, f"{folder} is warm: {kept} are kept")
