"""First of all: the verdict, what to do next, and the criteria with value, limit and action."""

import importlib
import shlex
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from oio.core.folders import CONF
from oio.inference.metrics import bearing
from oio.report.material import Material
from oio.report.origin import is_recorded, origin
from oio.report.page import NOTHING, Part, badge, bullets, escaped, paragraph, table
from oio.results.yaml_fields import SAFE

MEANING = {
    "PASS": "It can be trusted: every criterion is within its limits.",
    "WARN": "Use it with care: something is outside of its limits.",
    "FAIL": "Do not trust it: something contradicts it, or the readings tell too little.",
}
ORDER = ("FAIL", "WARN")
POSITION_DOF = 3  # with fewer joints a source of unknown strength has no position


def lead(material: Material) -> str:
    """Return the box at the top: words, answer, next actions."""
    summary = material.summary
    if not summary:
        return (
            f'<div class="lead warn">{paragraph("This run has no summary.json, so there is no verdict. It may have been cut off.")}</div>'
        )
    word = summary["verdict"]
    words = "".join(f" {escaped(about)} {badge(part)}" for about, part in (summary.get("verdicts") or {}).items())
    head = f'<p class="word">{badge(word)} {escaped(MEANING[word])}</p><p>{words}</p>'
    todo = f"<h2>What to do next</h2>{bullets(actions(material), True)}"
    return f'<div class="lead {word.lower()}">{head}{paragraph(answer(material))}{paragraph(origin(material), "note")}{todo}</div>'


def answer(material: Material) -> str:
    """Return where the source is, in a sentence; or that nothing was searched for, or found."""
    outcome = material.summary.get("calibrated")
    if not outcome:
        return "Nothing was searched for: this run calibrates only."
    place, sd = outcome.get("believed_m"), outcome.get("sd_m")
    if not place or sd is None or any(c["name"] == "localised" and c["word"] == "FAIL" for c in _criteria(material)):
        return "No position was found: " + (
            "the readings leave the source anywhere." if sd is None else f"the readings leave it to \N{PLUS-MINUS SIGN} {1e3 * sd:.0f} mm."
        )
    said = "declared" if outcome.get("found") else "not declared: its position is unverified"
    others = len(outcome.get("other_places") or [])
    more = f" {others} other {'place explains' if others == 1 else 'places explain'} the readings as well." if others else ""
    if 0 < material.story.dof < POSITION_DOF and material.story.left:
        return f"{_bearing(material)}; {said}, after {outcome['moves']} moves and {outcome['time_s']:.0f} s.{more}"
    at = ", ".join(f"{1e3 * v:.0f}" for v in place)
    where = f"({at}) mm in the arm's base frame, \N{PLUS-MINUS SIGN} {1e3 * sd:.0f} mm (one standard deviation of all axes together)"
    return f"The source is at {where}; {said}, after {outcome['moves']} moves and {outcome['time_s']:.0f} s.{more}"


def _bearing(material: Material) -> str:
    """The direction of the source from the first joint: with one joint or two no distance can be found."""
    story = material.story
    mean, cov = story.left[0]
    angles, jacobian = bearing(mean - story.shoulder_m)
    sd = np.degrees(np.sqrt(np.diag(jacobian @ cov @ jacobian.T)))
    told = [
        f"{name} {np.degrees(angles[i]):.1f} \N{PLUS-MINUS SIGN} {sd[i]:.1f} deg"
        for i, name in enumerate(("azimuth", "elevation")[: story.dof])
    ]
    return f"Only the direction of the source can be found with {story.dof} DoF: {', '.join(told)}, from the first joint of the arm"


def actions(material: Material) -> list[str]:
    """Return what to do, failures first, in each case causes before effects; each action once, with the criteria that ask for it."""
    bad = [c for word in ORDER for c in _criteria(material) if c["word"] == word]
    if bad and is_recorded(material):
        names = ", ".join(c["name"] for c in bad)
        return [f"Nothing can be measured again: use these data only for what they support. Outside of their limits: {names}."]
    asked: dict[str, list[str]] = {}
    for c in bad:
        asked.setdefault(c["action"], []).append(c["name"])
    if asked:
        return [f"{action} ({', '.join(names)})" for action, names in asked.items()]
    if material.summary.get("calibration") is None:
        return ["Go on: run the stages calibrate_bouts, map_beliefs and assemble_qr as well."]
    kept = f"{material.summary.get('sensor')} dof={material.summary.get('dof')}"
    file = shlex.quote(f"calibration={_from_here(material.folder) / 'calibration.yaml'}")
    again = f"python -m oio.run sensor={kept} {file} 'stage=[warm_up,baseline,navigate,evaluate]'"
    return [f"Keep the calibration.yaml of this run, and begin later runs in the same air with it: {again}"]


def _from_here(folder: Path) -> Path:
    """A folder as one would type it in the current one."""
    whole, here = folder.resolve(), Path.cwd()
    return whole.relative_to(here) if whole.is_relative_to(here) else whole


def _criteria(material: Material) -> list[dict[str, Any]]:
    return material.summary.get("criteria") or []


def explained(names: Iterable[str]) -> Iterator[tuple[str, str]]:
    """Yield the standard criteria with what each means: the first lines of its class."""
    standard = yaml.load((CONF / "verdict" / "standard.yaml").read_bytes(), Loader=SAFE)["criteria"]
    for name in names:
        if name in standard:
            module, _, kind = standard[name]["_target_"].rpartition(".")
            yield name, " ".join((getattr(importlib.import_module(module), kind).__doc__ or "").split())


def criteria_part(material: Material) -> Part:
    """Return the table of all criteria."""
    criteria = material.summary.get("criteria") or []
    worst_first = [c for word in (*ORDER, "PASS") for c in criteria if c["word"] == word]
    if is_recorded(material):  # nothing can be measured again
        worst_first = [{**c, "action": ""} for c in worst_first]
    rows = [(c["name"], c["about"], badge(c["word"]), c["found"], c["allowed"], c["action"] or NOTHING) for c in worst_first]
    heads = ("criterion", "about", "verdict", "found", "passes", "what to do")
    meanings = "".join(f"<dt>{escaped(name)}</dt><dd>{escaped(text)}</dd>" for name, text in explained(c["name"] for c in criteria))
    note = f"<details><summary>What the criteria mean</summary><dl>{meanings}</dl></details>"
    note += paragraph("Limits are in conf/verdict/standard.yaml. Nothing here uses what only a simulation knows.", "note")
    content = (
        table("Each criterion with its value and limits", heads, rows, raw=(2,), cards=True) + note
        if rows
        else paragraph("Nothing was judged.")
    )
    return Part("criteria", "Criteria", content)
