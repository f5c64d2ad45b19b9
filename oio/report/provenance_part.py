"""Where the numbers come from: the choices made where the paper is silent, and the versions, overrides and seeds of the run."""

import hashlib
import json
from typing import Any

from oio.report.material import Material
from oio.report.page import Part, escaped, paragraph, table

HOLES = (  # key, what the paper leaves open, what stands for it here
    ("bout.differential", "eq. (1) takes y'_t - y'_(t-1), the sentence above it y_t - y'_(t-1)"),
    ("bout.threshold", '"greater than the baseline measurements": than their largest, or than mean + 3 sigma'),
    ("bout.window_by_dof", 'the window k: "k = 5" in the text, another best one per DoF in the figure'),
    ("stage.baseline.samples", "five readings y_0..y_4 are the baseline"),
    ("assembly", "u_a and u_b go on the diagonals of R and Q unsquared, ppm and mm beside ppm^2 and m^2: gum or paper"),
    ("range_law.form", "RSSI falls with distance by a law that is not given"),
    ("range_law.exponent", "its exponent"),
    ("stage.map_beliefs.distances_m", "where the five measurements stand"),
    ("arm.encoder_drift_deg_s2", 'encoder drift "below 10^-3 deg/s^2": taken as a bound on a constant acceleration'),
    ("stop.sd_m", "when the source counts as found"),
    ("stage.navigate.dwell_s", "how long the nose stands still"),
)  # fmt: skip
CHOICES = ("sensor", "profile", "dof", "air", "world", "backend", "ekf", "assembly", "seed", "git", "clock")


def assumptions_part(material: Material) -> Part:
    """Return the holes of the paper with the key that fills each, and its value in this run."""
    rows = [(hole, key, _shown(_looked_up(material.config, key))) for key, hole in HOLES]
    text = (
        "The paper leaves these open; each is one key of the configuration, so that another reading of it is one word on the command line."
    )
    return Part(
        "assumptions",
        "Assumptions",
        paragraph(text)
        + table("Holes of the paper (France, Daescu, Paul, Prasad, 2025)", ("what is open", "key", "in this run"), rows, cards=True),
    )


def provenance_part(material: Material) -> Part:
    """Return the versions, git state, overrides, seeds and hashes."""
    told, log = material.identity, material.folder / "run.mcap"
    versions = json.loads(told.get("versions", "{}"))
    rows: list[tuple[str, str]] = [(key, told[key]) for key in CHOICES if key in told]
    rows += [(f"version of {name}", str(version)) for name, version in versions.items()]
    rows += [("overrides", " ".join(json.loads(told.get("overrides", "[]"))) or "none")]
    if "reproducible" in told:
        judged = json.loads(told["reproducible"])
        rows += [("reproducible", f"{judged['word']}{': ' if judged['reasons'] else ''}{'; '.join(judged['reasons'])}")]
    rows += [(f"input {name}", text) for name, text in json.loads(told.get("inputs", "{}")).items()]
    rows += [("SHA-256 of run.mcap", hashlib.sha256(log.read_bytes()).hexdigest())]
    config = f"<details><summary>The whole configuration</summary><pre tabindex='0'>{escaped(told.get('config', ''))}</pre></details>"
    return Part("provenance", "Provenance", table("What made this run", ("what", "value"), rows) + config)


def _looked_up(tree: Any, key: str) -> Any:
    for name in key.split("."):
        tree = tree.get(name) if isinstance(tree, dict) else None
    return tree


def _shown(value: Any) -> str:
    return "not in this run" if value is None else json.dumps(value)
