"""Free space where runs are written."""

import os
import shutil
from pathlib import Path
from typing import Annotated

from oio.core.settings import Within, settings
from oio.doctor.finding import FAIL, PASS, WARN, Finding

MB = 1e6


@settings
class Disk:
    """What a run and a sweep take [MB]."""

    run_mb: Annotated[float, Within(0, 1e6)]
    sweep_mb: Annotated[float, Within(0, 1e9)]

    def check(self) -> Finding:
        """FAIL if a run does not fit or nothing may be written, WARN if a sweep does not fit."""
        here = Path.cwd()
        return self.judge(here, shutil.disk_usage(here).free / MB, os.access(here, os.W_OK))

    def judge(self, folder: Path, free_mb: float, writable: bool) -> Finding:
        """Judge the free space [MB] of a folder."""
        found = f"{folder} has {free_mb / 1e3:.1f} GB free"
        if not writable:
            return Finding("disk", FAIL, f"{folder} cannot be written to", "Go to a folder of your own, or type hydra.run.dir=FOLDER.")
        if free_mb < self.run_mb:
            return Finding("disk", FAIL, found, f"Make room: a run takes up to {self.run_mb:g} MB.")
        if free_mb < self.sweep_mb:
            return Finding("disk", WARN, found, f"Make room, or sweep with logging=summary: a large sweep takes {self.sweep_mb:g} MB.")
        return Finding("disk", PASS, found)
