"""The search in 3-D, to be turned by hand: arm, nose path, range spheres of the calibration, places left for the source with their regions.

Traces in the format of plotly.js (https://plotly.com/javascript/reference); lengths in mm in the arm's base frame.
"""

import base64
import gzip
import json
from importlib import resources
from typing import Any

import numpy as np

from oio.core.records import Array
from oio.figures.style import BEACON, BELIEVED, CALIBRATED, SOURCE, TRUTH
from oio.inference.metrics import CHI2_95
from oio.report.material import Material

Trace = dict[str, Any]
MOST = 600  # points of a path
SPHERES = 5  # of the last repeat of the calibration


def traces(material: Material) -> list[Trace]:
    """Return the traces that the log has data for."""
    story, out = material.story, list[Trace]()
    out += _arm(material)
    for track, name, color, width in ((story.truth, "true nose", TRUTH, 4), (story.odometry, "nose, calibrated filter", CALIBRATED, 2)):
        if len(track):
            out.append(_line(track.p_m[:: max(1, len(track) // MOST)], name, color, width))
    out += _spheres(material)
    out += _places(material)
    marks = (("beacon", "beacon (known place)", BEACON, "diamond"), ("source", "true source (simulation)", SOURCE, "x"))
    out += [_mark(story.places[key], name, color, symbol) for key, name, color, symbol in marks if key in story.places]
    return out


def _arm(material: Material) -> list[Trace]:
    """Links of the arm as it stood at the end of the log."""
    links = material.story.links_m
    if not len(links):
        return []
    return [{**_line(links, "arm", "#444444", 12), "mode": "lines+markers", "marker": {"size": 5, "color": "#222222"}}]


def _spheres(material: Material) -> list[Trace]:
    """Range spheres of the last repeat in which the beacon was located."""
    repeats = material.stages.get("map_beliefs", {}).get("repeats", [])
    if not repeats:
        return []
    centres, radii = np.array(repeats[-1]["centres_m"], dtype=float), np.array(repeats[-1]["radii_m"], dtype=float)
    drawn = [(c, r) for c, r in zip(centres, radii, strict=True) if np.all(np.isfinite(c)) and 0.0 < r < 2.0][:SPHERES]
    name = "range spheres about the beacon (calibration)"
    return [_surface(c, r * np.eye(3), name, BEACON, 0.10, i == 0, "legendonly") for i, (c, r) in enumerate(drawn)]


def _places(material: Material) -> list[Trace]:
    """Places left for the source, best first, with their 95 % regions."""
    out = list[Trace]()
    for i, (mean, cov) in enumerate(material.places()):
        name = "source, 95 % region" if i == 0 else f"another place {i}, 95 % region"
        values, axes = np.linalg.eigh(cov)
        out.append(_surface(mean, axes * np.sqrt(CHI2_95[3] * np.maximum(values, 0.0)), name, BELIEVED, 0.35 if i == 0 else 0.2))
        out.append(_mark(mean, "source, as believed" if i == 0 else f"another place {i}", BELIEVED, "circle"))
    return out


def _line(p_m: Array, name: str, color: str, width: int) -> Trace:
    x, y, z = (np.round(1e3 * p_m[:, i], 1).tolist() for i in range(3))
    return {
        "type": "scatter3d",
        "mode": "lines",
        "x": x,
        "y": y,
        "z": z,
        "name": name,
        "opacity": 0.6,
        "line": {"color": color, "width": width},
    }


def _mark(p_m: Array, name: str, color: str, symbol: str) -> Trace:
    x, y, z = ([round(1e3 * float(v), 1)] for v in p_m)
    marker = {"size": 6, "color": color, "symbol": symbol, "line": {"color": "black", "width": 1}}
    return {"type": "scatter3d", "mode": "markers", "x": x, "y": y, "z": z, "name": name, "marker": marker}


def _surface(centre_m: Array, axes_m: Array, name: str, color: str, opacity: float, listed: bool = True, visible: object = True) -> Trace:
    """An ellipsoid: `axes_m` (3, 3) are its half axes as columns."""
    u, v = np.meshgrid(np.linspace(0.0, 2.0 * np.pi, 25), np.linspace(0.0, np.pi, 13))
    ball = np.stack([np.cos(u) * np.sin(v), np.sin(u) * np.sin(v), np.cos(v)])
    x, y, z = (np.round(1e3 * (centre_m[i] + np.tensordot(axes_m[i], ball, 1)), 1).tolist() for i in range(3))
    return {
        "type": "surface", "x": x, "y": y, "z": z, "name": name, "opacity": opacity, "showscale": False, "hoverinfo": "name",
        "colorscale": [[0, color], [1, color]], "showlegend": listed, "visible": visible, "legendgroup": name,
    }  # fmt: skip


def scripts(drawn: list[Trace]) -> str:
    """Return the script elements: plotly.js packed, as it is 4.8 MB, the traces, and what draws them when the page has loaded."""
    packed = base64.b64encode(gzip.compress(_plotly(), 6, mtime=0)).decode()
    data = json.dumps(drawn, allow_nan=False).replace("<", "\\u003c")
    viewer = (resources.files("oio.report") / "viewer.js").read_text(encoding="utf-8")
    return (
        f'<script type="application/octet-stream" id="plotly">{packed}</script>'
        f'<script type="application/json" id="traces">{data}</script><script>{viewer}</script>'
    )


def _plotly() -> bytes:
    return (resources.files("plotly") / "package_data" / "plotly.min.js").read_bytes()
