"""Python and packages against the project's lock."""

import platform

from oio.cli import lock_file
from oio.core.settings import settings
from oio.doctor.finding import FAIL, PASS, WARN, Finding


@settings
class Versions:
    """Versions of Python that are supported: from, and below."""

    python_from: str
    python_below: str

    def check(self) -> Finding:
        """FAIL for another Python, WARN for packages that the lock does not have so."""
        return self.judge(platform.python_version(), lock_file.differing())

    def judge(self, python: str, differing: tuple[str, ...] | None) -> Finding:
        """Judge a version of Python and the packages that differ from the lock (None: there is no lock)."""
        if not _numbers(self.python_from) <= _numbers(python) < _numbers(self.python_below):
            wanted = f"Python {self.python_from} up to, but not, {self.python_below}"
            return Finding("versions", FAIL, f"Python {python}", f"Install {wanted}, then type make venv.")
        if differing is None:
            return Finding(
                "versions", WARN, f"Python {python}; no requirements.lock", "Work in a clone of the project: its lock pins packages."
            )
        if differing:
            return Finding("versions", WARN, f"Python {python}; {'; '.join(differing)}", "Type make venv: it installs the lock's packages.")
        return Finding("versions", PASS, f"Python {python}, packages as in requirements.lock")


def _numbers(version: str) -> tuple[int, ...]:
    return tuple(int(part) for part in version.split(".")[:2])
