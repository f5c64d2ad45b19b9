"""What a check finds, and what a check is."""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

PASS, WARN, FAIL = "PASS", "WARN", "FAIL"


@dataclass(frozen=True, slots=True)
class Finding:
    """One line of the report: `word` is PASS, WARN or FAIL; `action` is what to do, empty with PASS."""

    name: str
    word: str
    found: str
    action: str = ""


@runtime_checkable
class Check(Protocol):
    """A check of the computer. It reads and changes nothing that is not its own."""

    def check(self) -> Finding:
        """Look, and say what was found. Raises nothing that a person could act on: that is a finding."""
        ...
