"""The report of all checks: lines for a person, JSON for machines."""

import dataclasses
import json
from collections.abc import Sequence

from oio.cli import terminal
from oio.doctor.finding import FAIL, PASS, WARN, Finding

SCHEMA = "oio.doctor/1"
COLOURS = {PASS: "green", WARN: "yellow", FAIL: "red"}


def show(finding: Finding) -> None:
    """Print one finding, and below it what to do."""
    console = terminal.console(soft_wrap=True, highlight=False)
    console.print(f"[bold {COLOURS[finding.word]}]{finding.word}[/]", end="  ")
    console.print(f"{finding.name}: {finding.found}", markup=False)
    if finding.action:
        console.print(f"      {finding.action}", markup=False)


def to_json(findings: Sequence[Finding]) -> str:
    """Serialise the findings, with the worst word of all."""
    document = {"schema": SCHEMA, "word": worst(findings), "findings": [dataclasses.asdict(finding) for finding in findings]}
    return json.dumps(document, indent=2) + "\n"


def worst(findings: Sequence[Finding]) -> str:
    """Return the worst word of all findings."""
    return max((finding.word for finding in findings), key=(PASS, WARN, FAIL).index)
