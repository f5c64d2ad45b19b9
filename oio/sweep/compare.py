"""Two sweeps compared in pairs: the same case and seed in both, so that what the seed decides cancels."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from oio.core.errors import BadInput
from oio.core.records import Array
from oio.results.yaml_fields import SAFE
from oio.sweep.bootstrap import interval
from oio.sweep.manifest import Manifest
from oio.sweep.records import CHOICES, Record, error_of, overridden, records, shown_error


@dataclass(frozen=True)
class Comparison:
    """Errors of pairs (n,), in mm (deg with one or two joints), and what differs in the configurations: key, value in A, value in B."""

    a: Array
    b: Array
    unpaired: int
    paired_by: tuple[str, ...]
    unit: str
    differs: list[tuple[str, str, str]]

    @property
    def ratio(self) -> float:
        """Geometric mean of the ratios of B's error to A's."""
        return float(np.exp(np.mean(self._logs)))

    @property
    def ratio_interval(self) -> tuple[float, float]:
        """Its 95 % bootstrap interval over the pairs."""
        low, high = interval(self._logs, np.mean)
        return float(np.exp(low)), float(np.exp(high))

    @property
    def _logs(self) -> Array:
        return np.log(np.maximum(self.b, 1e-9)) - np.log(np.maximum(self.a, 1e-9))


def compare(folder_a: Path, folder_b: Path) -> Comparison:
    """Pair the jobs that are done in both folders. Raises BadInput if there is none, or if a pair is ambiguous."""
    manifests = [Manifest.read(folder) for folder in (folder_a, folder_b)]
    sides = [[row for row in records(m.outcomes()) if row["state"] == "done" and error_of(row) is not None] for m in manifests]
    for folder, rows in zip((folder_a, folder_b), sides, strict=True):
        if not rows:
            raise BadInput(f"{folder} has no job that is done and scored. See it with python -m oio.sweep status {folder}.")
    keys = _paired_by(*sides)
    a, b = (_by_key(rows, keys, folder) for rows, folder in zip(sides, (folder_a, folder_b), strict=True))
    shared = [key for key in a if key in b]
    if not shared:
        raise BadInput(f"no job of {folder_a} has the same {', '.join(keys)} as one of {folder_b}, so nothing can be compared in pairs.")
    of_a, of_b = (np.array([shown_error(side[key])[0] for key in shared], dtype=float) for side in (a, b))
    differs = _differences([(folder_a / a[key]["job"], folder_b / b[key]["job"]) for key in shared])
    return Comparison(of_a, of_b, len(a) + len(b) - 2 * len(shared), tuple(keys), shown_error(a[shared[0]])[1], differs)


def _paired_by(a: Sequence[Record], b: Sequence[Record]) -> list[str]:
    """The choices and swept keys that both sweeps share; those without a common value are what is compared."""
    swept = [key for key in overridden(a[0]) if key in b[0] and key not in ("state", *CHOICES)]
    return [key for key in (*CHOICES, *swept) if {str(row.get(key)) for row in a} & {str(row.get(key)) for row in b}]


def _by_key(rows: Sequence[Record], keys: Sequence[str], folder: Path) -> dict[tuple[str, ...], Record]:
    found: dict[tuple[str, ...], Record] = {}
    for row in rows:
        key = tuple(str(row.get(name)) for name in keys)
        if found.setdefault(key, row) is not row:
            told = f"{found[key]['job']} and {row['job']} in {folder} have the same {', '.join(keys)}"
            raise BadInput(f"{told}, so it is not clear which to compare. Compare sweeps in which one thing differs.")
    return found


def _differences(pairs: Sequence[tuple[Path, Path]]) -> list[tuple[str, str, str]]:
    """The keys of config.yaml that differ in any pair; `(several)` where their values are not the same in all."""
    found: dict[str, set[tuple[str, str]]] = {}
    for one, other in pairs:
        a, b = (_flat(yaml.load((path / "config.yaml").read_text(encoding="utf-8"), Loader=SAFE)) for path in (one, other))
        for key in sorted({*a, *b}):
            if a.get(key) != b.get(key):
                found.setdefault(key, set()).add((a.get(key, "-"), b.get(key, "-")))
    told = {key: next(iter(v)) if len(v) == 1 else ("(several)", "(several)") for key, v in found.items()}
    return [(key, *values) for key, values in sorted(told.items()) if not _is_copy(key, told)]


def _is_copy(key: str, told: Mapping[str, tuple[str, str]]) -> bool:
    """Whether the key is one of the root that a stage or the backend was given, e.g. stage.navigate.ekf.steps beside ekf.steps."""
    parts = key.split(".")
    return any(told.get(".".join(parts[n:])) == told[key] for n in range(1, len(parts)))


def _flat(node: Any, above: str = "") -> dict[str, str]:
    if not isinstance(node, Mapping):
        return {above: str(node)}
    return {path: text for key, value in node.items() for path, text in _flat(value, f"{above}.{key}" if above else str(key)).items()}
