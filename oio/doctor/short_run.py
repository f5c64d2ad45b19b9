"""A short simulated run in a temporary folder: everything from the configuration to summary.json."""

import tempfile
import time
from pathlib import Path
from typing import Annotated

from oio.cli.build import build
from oio.cli.compose import compose
from oio.cli.execute import execute
from oio.cli.hydra_errors import known_error
from oio.cli.plugins import plugin_packages
from oio.core.folders import CONF
from oio.core.settings import Within, settings
from oio.doctor.finding import FAIL, PASS, WARN, Finding


@settings
class ShortRun:
    """Words of the run, and the time [s] above which a computer is called slow."""

    words: tuple[str, ...]
    slow_s: Annotated[float, Within(0.1, 3600)]

    def check(self) -> Finding:
        """FAIL if the run does not end well, WARN if it is slow."""
        began_s = time.monotonic()
        try:
            self._run()
        except Exception as error:  # whatever a run raises is the finding
            return self.judge(time.monotonic() - began_s, str(known_error(error, CONF) or repr(error)))
        return self.judge(time.monotonic() - began_s, None)

    def judge(self, took_s: float, error: str | None) -> Finding:
        """Judge how long the run took [s], and its error, if it had one."""
        command = f"python -m oio.run {' '.join(self.words)}"
        if error is not None:
            return Finding("a short run", FAIL, error, f"Type OIO_FULL_ERROR=1 {command}, which shows where.")
        if took_s > self.slow_s:
            action = "Type it again: the first one compiles. Then look what else runs on this computer."
            return Finding("a short run", WARN, f"{took_s:.1f} s", action)
        return Finding("a short run", PASS, f"{took_s:.1f} s")

    def _run(self) -> None:
        composed = compose(self.words, tuple(plugin_packages()))
        with tempfile.TemporaryDirectory() as folder:
            execute(build(composed.cfg, composed.choices, list(self.words)), Path(folder) / "run", quiet=True)
