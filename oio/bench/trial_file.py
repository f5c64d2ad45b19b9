"""Trials of earlier benchmarks, read back from their trials.csv."""

import csv
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, get_type_hints

from oio.bench.score import Case, Score, Trial
from oio.cli.csv_file import names
from oio.core.errors import BadInput

TRIALS = "trials.csv"
FIELDS = [*Case._fields, "seed", *names(Score), "reason"]
_PARSE: dict[type, Callable[[str], Any]] = {int: int, float: float, str: str, bool: {"True": True, "False": False}.__getitem__}


def read_trials(folders: Sequence[str]) -> list[Trial]:
    """Return the trials of several folders, in their order. Raises BadInput for a file that is none, and for a trial that comes twice."""
    found = [trial for folder in folders for trial in read_csv(Path(folder) / TRIALS)]
    seen = set[tuple[Case, int]]()
    for trial in found:
        if (trial.case, trial.seed) in seen:
            raise BadInput(f"seed {trial.seed} of {'/'.join(map(str, trial.case))} is in two of the folders. Give each trial once.")
        seen.add((trial.case, trial.seed))
    return found


def read_csv(path: Path) -> list[Trial]:
    """Return the trials of one file. Raises BadInput for what is none."""
    try:
        with path.open(encoding="utf-8", newline="") as file:
            rows = csv.DictReader(file)
            if list(rows.fieldnames or ()) != FIELDS:
                raise BadInput(f"{path} has other columns than this version writes. Give folders of `python -m oio.bench`, made by it.")
            return [_trial(row) for row in rows]
    except OSError as error:
        raise BadInput(f"{path} cannot be read ({error.strerror}). Give folders of earlier runs, e.g. from=outputs/a,outputs/b.") from None
    except (KeyError, ValueError, TypeError) as error:
        raise BadInput(f"{path} has a row that cannot be read ({error}). Leave that folder out.") from None


def _trial(row: Mapping[str, str]) -> Trial:
    case, score = _parsed(Case, row), None if row["reason"] else _parsed(Score, row)
    assert isinstance(case, Case) and (score is None or isinstance(score, Score))
    return Trial(case, int(row["seed"]), score, row["reason"])


def _parsed(kind: type, row: Mapping[str, str]) -> object:
    return kind(**{name: _PARSE[hint](row[name]) for name, hint in get_type_hints(kind).items()})
