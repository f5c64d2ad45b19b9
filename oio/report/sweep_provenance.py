"""Where the numbers of a sweep come from: its command, seeds, the code and packages that ran its jobs, and the files that they read."""

import shlex
from collections.abc import Mapping, Sequence

from oio.cli.run_folder import read_json
from oio.report.page import table
from oio.sweep.manifest import INPUTS, Manifest
from oio.sweep.records import Record

NAMES = {"git": "commit", "python": "Python"}


def sweep_provenance(manifest: Manifest, rows: Sequence[Record]) -> str:
    """Return the table: the command, the seeds, commit and versions of every process that ran jobs, and each input file with its hash."""
    told = [
        ("command", f"python -m oio.run {shlex.join(manifest.command)}"),
        ("jobs", str(len(manifest.jobs))),
        ("seeds", in_ranges(sorted({row["seed"] for row in rows if isinstance(row.get("seed"), int)}))),
        ("fingerprint of code and configuration", manifest.version),
    ]
    names = list(dict.fromkeys(name for made in manifest.made_with for name in made))
    told += [(NAMES.get(name, f"version of {name}"), "; ".join(_distinct(manifest.made_with, name))) for name in names]
    told += [(f"input {name}", f"SHA-256 begins with {digits}") for name, digits in _inputs(manifest).items()]
    return table("What made this sweep", ("what", "value"), told)


def _distinct(made_with: Sequence[Mapping[str, str]], name: str) -> list[str]:
    return list(dict.fromkeys(made[name] for made in made_with if name in made))


def _inputs(manifest: Manifest) -> dict[str, str]:
    """Files that jobs read, by their path, with the hashes that they had."""
    found: dict[str, list[str]] = {}
    for job in manifest.jobs:
        for name, digits in (read_json(manifest.folder / job.folder / INPUTS) or {}).items():
            if digits not in found.setdefault(name, []):
                found[name].append(str(digits))
    return {name: "; ".join(digits) for name, digits in sorted(found.items())}


def in_ranges(numbers: Sequence[int]) -> str:
    """Return ascending whole numbers as ranges, e.g. `0 to 9, 12`; `not known` where there is none."""
    ranges: list[list[int]] = []
    for number in numbers:
        if ranges and number == ranges[-1][1] + 1:
            ranges[-1][1] = number
        else:
            ranges.append([number, number])
    return ", ".join(str(low) if low == high else f"{low} to {high}" for low, high in ranges) or "not known"
