"""The search in 3-D, to be turned by hand: arm, nose before and after calibration, range spheres, places left for the source."""

import base64
import gzip
import json
from importlib import resources

import numpy as np

from oio.core.records import Array
from oio.figures.style import BEACON, BELIEVED, CALIBRATED, DEAD, SOURCE, TRUTH, VARIANTS
from oio.figures.track import TrackOverTime
from oio.report.material import Material
from oio.report.scene_shapes import HIDDEN, Trace, ellipsoids, entry, grouped, line, mark, regions_95

TELLING = 3  # range spheres that are shown at first: the smallest, since the error of a range grows with it
LARGEST_M = 2.0  # a larger sphere tells nothing
INSTANTS = 8  # of a track, with the region of the nose


def traces(material: Material) -> list[Trace]:
    """Return the traces that the log has data for; what was before calibration is hidden at first."""
    story, out = material.story, _arm(material)
    if len(story.truth):
        out.append(line(story.truth.p_m, "true nose", TRUTH, 4))
    if len(story.odometry):
        name = "its 95 % regions"
        out.append(line(story.odometry.p_m, "nose, calibrated", CALIBRATED, 2))
        out += grouped(name, entry(name, CALIBRATED), _regions(story.odometry, name, CALIBRATED))
    out += [*_spheres(material), *_places(material)]
    marks = (("beacon", "beacon (known place)", BEACON, "diamond"), ("source", "true source", SOURCE, "x"))
    out += [mark(story.places[key], name, color, symbol) for key, name, color, symbol in marks if key in story.places]
    return out + _before(material)


def _arm(material: Material) -> list[Trace]:
    """Links of the arm as it stood at the end of the log."""
    links = material.story.links_m
    if not len(links):
        return []
    return [{**line(links, "arm", "#444444", 12), "mode": "lines+markers", "marker": {"size": 5, "color": "#222222"}}]


def _regions(track: TrackOverTime, name: str, color: str, visible: object = True) -> Trace:
    """The region of the nose at some instants."""
    at = np.unique(np.linspace(0, len(track) - 1, INSTANTS).astype(int))
    return regions_95([(track.p_m[i], track.cov_m2[i]) for i in at], name, color, 0.18, visible)


def _before(material: Material) -> list[Trace]:
    """Before calibration: each cold start's nose and source with their regions as one entry of the legend, and the encoders alone."""
    story, out = material.story, list[Trace]()
    for key, (words, color) in VARIANTS.items():
        if key not in story.others or not len(story.others[key].nose):
            continue
        nose, source = story.others[key].nose, story.others[key].source
        place = source.p_m[-1], source.cov_m2[-1]
        out += grouped(
            f"{words}: nose, source, 95 % regions", line(nose.p_m, words, color, 2, HIDDEN), _regions(nose, words, color, HIDDEN),
            regions_95([place], words, color, 0.25, HIDDEN), mark(place[0], f"source, {words}", color, "square", HIDDEN),
        )  # fmt: skip
    return out + ([line(story.dead.p_m, "nose, encoders alone", DEAD, 2, HIDDEN)] if len(story.dead) else [])


def _spheres(material: Material) -> list[Trace]:
    """Range spheres of the last repeat in which the beacon was located."""
    repeats = material.stages.get("map_beliefs", {}).get("repeats", [])
    if not repeats:
        return []
    centres, radii = np.array(repeats[-1]["centres_m"], dtype=float), np.array(repeats[-1]["radii_m"], dtype=float)
    found = sorted((r, c) for r, c in zip(radii.tolist(), centres.tolist(), strict=True) if np.all(np.isfinite(c)) and 0.0 < r < LARGEST_M)
    shapes: list[tuple[Array, Array]] = [(np.array(c), r * np.eye(3)) for r, c in found]
    out = list[Trace]()
    for name, some, shown in (("range spheres about the beacon", shapes[:TELLING], True), ("more range spheres", shapes[TELLING:], HIDDEN)):
        if some:
            out += grouped(name, entry(name, BEACON, shown), ellipsoids(some, name, BEACON, 0.10, shown))
    return out


def _places(material: Material) -> list[Trace]:
    """Places left for the source, best first, with their 95 % regions."""
    out = list[Trace]()
    best, others = material.story.left[:1], material.story.left[1:]
    for name, places, symbol, opacity in (
        ("source and 95 % region, calibrated", best, "circle", 0.35),
        ("other places left", others, "circle-open", 0.2),
    ):
        if places:
            marks = mark(np.array([mean for mean, _ in places]), name, BELIEVED, symbol)
            out += grouped(name, marks, regions_95(places, name, BELIEVED, opacity))
    return out


def scripts(drawn: list[Trace]) -> str:
    """Return the script elements: plotly.js (4.8 MB) and the traces, both packed, and what draws them when the page has loaded."""
    viewer = (resources.files("oio.report") / "viewer.js").read_text(encoding="utf-8")
    packed = {"plotly": _plotly(), "traces": json.dumps(drawn, allow_nan=False, separators=(",", ":")).encode()}
    data = "".join(f'<script type="application/octet-stream" id="{name}">{_packed(text)}</script>' for name, text in packed.items())
    return f"{data}<script>{viewer}</script>"


def _packed(text: bytes) -> str:
    return base64.b64encode(gzip.compress(text, 6, mtime=0)).decode()


def _plotly() -> bytes:
    return (resources.files("plotly") / "package_data" / "plotly.min.js").read_bytes()
