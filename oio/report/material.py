"""What a run left behind, as a report needs it: the history from its log, results of stages, summary, calibration, configuration."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from oio.core.errors import BadInput
from oio.core.records import Array, Event, Innovation, seconds
from oio.figures.run_history import RunHistory, run_history
from oio.figures.titles import read_summary
from oio.log import read_run
from oio.results.yaml_fields import plain_yaml

Document = dict[str, Any]
CLEAN = ("warm_up", "baseline")  # stages without a source
WITHOUT = "Remove it to report without it."


@dataclass(frozen=True)
class Material:
    """A run: its folder, the history and stage results from its log, and its files; {} where there is none."""

    folder: Path
    story: RunHistory
    stages: Document
    innovations: tuple[Innovation, ...]
    events: tuple[Event, ...]
    summary: Document
    calibration: Document
    config: Document

    @classmethod
    def read(cls, folder: Path) -> "Material":
        """Read the folder of a run that is done; raises BadInput for anything else."""
        log = folder / "run.mcap"
        if not log.is_file():
            raise BadInput(f"{folder} has no run.mcap, so there is nothing to report. {_why(folder)}")
        run = read_run(log)
        events = tuple(sample for sample in run.samples if isinstance(sample, Event))
        summary, files = read_summary(folder / "summary.json"), [_yaml(folder / name) for name in ("calibration.yaml", "config.yaml")]
        return cls(folder, run_history(run, log), run.results, tuple(run.innovations), events, summary, *files)

    def baselines_ppm(self) -> list[float]:
        """Baseline of each element [ppm]."""
        return [float(element["ppm"]) for element in self.stages.get("baseline", {}).get("elements", [])]

    def clean_air(self) -> dict[str, tuple[Array, Array]]:
        """Readings in clean air by element: t_s (n,) s and ppm (n,), of the stages without a source."""
        spans = [span for span in self.story.spans if span.stage in CLEAN]
        rows = [(r.element, seconds(r.t_ns), r.ppm) for r in self.story.readings if np.isfinite(r.ppm)]
        inside = [row for row in rows if any(span.begin_s <= row[1] <= span.end_s for span in spans)]
        found = {
            e: np.array(sorted({t_s: ppm for element, t_s, ppm in inside if element == e}.items())) for e in {row[0] for row in inside}
        }
        return {f"element {e}": (found[e][:, 0], found[e][:, 1]) for e in sorted(found)}

    @property
    def moved(self) -> bool:
        """Whether the nose was anywhere but at rest: it searched, or it located the beacon."""
        return any(span.stage not in CLEAN for span in self.story.spans)

    def bouts(self) -> list[Event]:
        """Bouts of the calibration."""
        return [sample for sample in self.events if sample.kind == "bout"]

    @property
    def identity(self) -> dict[str, str]:
        """The choices of the run and its provenance, from the log's metadata."""
        return self.story.identity


def _why(folder: Path) -> str:
    if (folder / "run.mcap.part").is_file():
        return f"The run was cut off: type python -m oio.recover {folder / 'run.mcap.part'}"
    if (folder / "summary.json").is_file():
        return "It was made with logging=summary, or is of several trials: run it again with logging=full trials=1."
    return "Give the folder of a run, e.g. python -m oio.report outputs/DATE/TIME_ec_5dof"


def _yaml(path: Path) -> Document:
    """A file as plain data; nothing is built from it."""
    try:
        text = path.read_text(encoding="utf-8") if path.is_file() else ""
    except (OSError, UnicodeDecodeError) as error:
        raise BadInput(f"{path} cannot be read ({error}). {WITHOUT}") from None
    document = plain_yaml(text, str(path), WITHOUT)
    return document if isinstance(document, dict) else {}
