"""The folder of recordings, OIO_DATA."""

import os
from pathlib import Path

import yaml

from oio.core.folders import CONF
from oio.core.settings import settings
from oio.doctor.finding import FAIL, PASS, WARN, Finding


@settings
class Recordings:
    """Name of the variable that names the folder."""

    variable: str

    def check(self) -> Finding:
        """FAIL if the variable names no folder, WARN if it is not set or recordings are missing."""
        return self.judge(os.environ.get(self.variable), wanted())

    def judge(self, given: str | None, wanted: dict[str, str]) -> Finding:
        """Judge the value of the variable (None: not set) by the file or folder below it of each recording."""
        if given is not None and not Path(given).is_dir():
            return Finding("recordings", FAIL, f"{self.variable}={given} is no folder", f"Type export {self.variable}=FOLDER, or unset it.")
        folder = Path("data" if given is None else given)
        here = [name for name, path in wanted.items() if (folder / path).exists()]
        missing = [name for name in wanted if name not in here]
        found = f"{self.variable}{' is not set' if given is None else f'={given}'}; there: {', '.join(here) or 'none'}"
        if missing:
            action = f"Only for recording={', '.join(missing)}: conf/recording says where each comes from. Put it below {self.variable}."
            return Finding("recordings", WARN, found, action)
        return Finding("recordings", PASS, found)


def wanted() -> dict[str, str]:
    """Return the file or folder of every recording of conf/, below OIO_DATA."""
    described = {path.stem: yaml.safe_load(path.read_text(encoding="utf-8")) for path in sorted((CONF / "recording").glob("*.yaml"))}
    named = {name: keys.get("file", keys.get("folder")) for name, keys in described.items()}
    return {name: str(path) for name, path in named.items() if path is not None}  # recording=csv has none of its own
