"""Report of a sweep: how many of its runs can be trusted, medians over sensor, DoF and air, distributions, the runs to look at first."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from oio.figures.sweep_errors import PANELS, distributions, heat_map
from oio.report.drawing import WIDE_IN, Drawing
from oio.report.page import Part, badge, bullets, escaped, figure, page, paragraph, table
from oio.report.sweep_provenance import sweep_provenance
from oio.sweep.group_table import HEADS, group_table, usual_keys
from oio.sweep.manifest import Manifest, Outcome
from oio.sweep.records import Record, error_of, records, shown_error
from oio.sweep.row_display import cell
from oio.sweep.sheet import columns
from oio.sweep.worst import worst

WORST = 20
NEXT = 5  # things to do, at most


def sweep_report(folder: Path) -> tuple[str, Sequence[Drawing]]:
    """Return the page of the sweep in `folder`, and its figures. Raises BadInput where there is no sweep."""
    manifest = Manifest.read(folder)
    outcomes = manifest.outcomes()
    rows = records(outcomes)
    drawn = _drawings(rows)
    figures = f'<div class="figures">{"".join(figure(one.name, one.svg(), one.caption) for one in drawn)}</div>'
    parts = [
        Part("errors", "Errors", figures + _groups(rows)), _criteria(outcomes), _worst(folder, rows),
        Part("provenance", "Provenance", sweep_provenance(manifest, rows)),
    ]  # fmt: skip
    return page(f"OIO report: sweep of {len(rows)} runs", _lead(rows, outcomes), parts), drawn


def _lead(rows: Sequence[Record], outcomes: Sequence[Outcome]) -> str:
    done = [row for row in rows if row["state"] == "done"]
    words, scored = Counter(row.get("verdict") for row in done), Counter(row.get("scored.word") for row in done)
    counts = " ".join(f"{badge(word)} {words[word]}" for word in ("PASS", "WARN", "FAIL"))
    kind = "fail" if not done or len(done) < len(rows) else "pass" if words["PASS"] == len(done) else "warn"
    said = [f"{len(done)} of {len(rows)} runs are done."]
    outside = [f"{name} ({count['WARN'] + count['FAIL']})" for name, count in _judged(outcomes).items() if count["WARN"] + count["FAIL"]]
    said += [f"Criteria outside of their limits, with the number of runs: {', '.join(outside)}."] if outside else []
    if scored["WRONG"] or scored["RIGHT"]:
        sure = sum(1 for row in done if row.get("verdict") == "PASS" and row.get("scored.word") == "WRONG")
        said.append(f"Against the truth (simulation only): {scored['RIGHT']} right, {scored['WRONG']} wrong, {sure} of these with a PASS.")
    asked = _asked(outcomes)
    todo = f"<h2>What to do next</h2>{bullets(asked, True)}" if asked else ""
    return f'<div class="lead {kind}"><p class="word">{counts}</p>{"".join(map(paragraph, said))}{todo}</div>'


def _asked(outcomes: Sequence[Outcome]) -> list[str]:
    """What the criteria that warned or failed ask for, first what most runs ask for."""
    asked: dict[str, tuple[Counter[str], set[str]]] = {}
    for outcome in outcomes:
        for c in (outcome.summary or {}).get("criteria") or []:
            if c["action"]:
                runs, names = asked.setdefault(c["action"], (Counter(), set()))
                runs[outcome.job.folder] += 1
                names.add(c["name"])
    most = sorted(asked.items(), key=lambda item: (-len(item[1][0]), item[0]))
    return [f"{action} ({', '.join(sorted(names))}: {len(runs)} runs)" for action, (runs, names) in most[:NEXT]]


def _drawings(rows: Sequence[Record]) -> list[Drawing]:
    done = [row for row in rows if error_of(row) is not None]
    places = [row for row in done if row.get("calibrated.source_error_m") is not None]
    keys = list(dict.fromkeys((str(r["sensor"]), str(r["dof"]), str(r.get("air"))) for r in places))
    medians = {key: 1e3 * float(np.median([error_of(r) for r in places if _cell(r) == key])) for key in keys}
    panels = -(-len({key[2] for key in keys}) // PANELS)  # rows of them
    by = usual_keys(rows)
    groups = [_group(row, by, places or done) for row in group_table(places or done, by)] if done else []
    unit = "mm" if places else "deg"
    tall = 1.6 + 0.28 * min(len(groups), 40)
    return [
        Drawing(
            "heat_map", (WIDE_IN, 0.6 + max(panels, 1) * (1.0 + 0.4 * len({k[0] for k in keys}))),
            "Median source error in mm by sensor, DoF and air; dark is far off.",
            lambda f: heat_map(f, medians),
        ),
        Drawing(
            "distributions", (WIDE_IN, tall), "Error of each run by group, medians with 95 % bootstrap intervals, and the cold start.",
            lambda f: distributions(f, groups, unit),
        ),
    ]  # fmt: skip


def _cell(row: Record) -> tuple[str, str, str]:
    return str(row["sensor"]), str(row["dof"]), str(row.get("air"))


def _group(row: dict[str, Any], by: Sequence[str], scored: Sequence[Record]) -> tuple[str, Any, Any, dict[str, Any]]:
    members = [r for r in scored if all(str(r.get(key, "")) == row[key] for key in by)]
    factor = 1e3 if members and members[0].get("calibrated.source_error_m") is not None else 1.0
    calibrated, cold = (factor * np.array([error_of(r, which) for r in members], dtype=float) for which in ("calibrated", "cold"))
    return ", ".join(f"{row[key]} DoF" if key == "dof" else row[key] for key in by), calibrated, cold, row


def _groups(rows: Sequence[Record]) -> str:
    found = group_table(rows, None)
    heads = [head for head in columns(found) if not head.endswith(("_low", "_high"))]
    body = [[cell(row, head) for head in heads] for row in found]
    meanings = "".join(f"<dt>{escaped(head)}</dt><dd>{escaped(what)}</dd>" for head, what in HEADS.items())
    shown = table("Groups of runs; intervals are 95 % bootstrap intervals", heads, body, cards=True)
    return f"{shown}<details><summary>What the columns mean</summary><dl>{meanings}</dl></details>"


def _criteria(outcomes: Sequence[Outcome]) -> Part:
    """How often each criterion warned and failed."""
    rows = [(name, *(str(count[word]) for word in ("PASS", "WARN", "FAIL"))) for name, count in _judged(outcomes).items()]
    content = (
        table("Runs by verdict of each criterion", ("criterion", "PASS", "WARN", "FAIL"), rows)
        if rows
        else paragraph("Nothing was judged.")
    )
    return Part("criteria", "Criteria", content)


def _judged(outcomes: Sequence[Outcome]) -> dict[str, Counter[str]]:
    """How many runs have each word, by criterion."""
    counts: dict[str, Counter[str]] = {}
    for outcome in outcomes:
        for c in (outcome.summary or {}).get("criteria") or []:
            counts.setdefault(c["name"], Counter())[c["word"]] += 1
    return counts


def _worst(folder: Path, rows: Sequence[Record]) -> Part:
    """The runs to look at first, each linked to its report, or to its folder."""
    found = worst(rows, WORST)
    if not found:
        return Part("worst", "Runs to look at first", paragraph("Nothing is failed, wrong or far off."))
    lines = [
        (
            _link(folder, row["job"]),
            why,
            "" if error_of(row) is None else "{:.1f} {}".format(*shown_error(row)),
            str(row.get("verdict", "")),
        )
        for row, why in found
    ]
    shown = table("Failed, wrong or far off, the most alarming first", ("run", "why", "error", "verdict"), lines, raw=(0,))
    note = paragraph(f"A run's own report: python -m oio.report {folder / found[0][0]['job']}", "note")
    return Part("worst", "Runs to look at first", shown + note)


def _link(folder: Path, job: str) -> str:
    report = f"{job}/report.html" if (folder / job / "report.html").is_file() else f"{job}/"
    return f'<a href="{escaped(report)}">{escaped(job)}</a>'
