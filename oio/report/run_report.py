"""Report of one run."""

from collections.abc import Sequence
from pathlib import Path

import yaml

from oio.core.folders import CONF
from oio.figures.titles import headline
from oio.report.drawing import Drawing
from oio.report.figure_parts import drawings
from oio.report.material import Material
from oio.report.numbers_part import calibration_part, truth_part
from oio.report.page import Part, figure, page
from oio.report.provenance_part import assumptions_part, provenance_part
from oio.report.scene_3d import scripts, traces
from oio.report.scene_picture import scene_drawing
from oio.report.sensor_part import sensor_table
from oio.report.verdict_part import criteria_part, lead
from oio.report.words_part import words_part
from oio.results.yaml_fields import SAFE

HEADINGS = {
    "place": "Where the source is",
    "signal": "Readings and bouts",
    "sensor": "The sensor alone",
    "filter": "Is the filter consistent?",
    "nose": "Where the nose is",
}
SPACE = (
    '<figure><div id="space" class="space" role="group" aria-label="The search in 3-D: arm, nose path, places left for the source">'
    "This needs JavaScript; the picture below shows the search from above.</div>"
    "<figcaption>The search in 3-D, in mm: drag to turn, scroll to zoom, click an entry of the legend to show or hide it. Blue: the nose "
    "by the calibrated filter, with its 95 % regions at some instants. Green: ranges that calibration took from its readings, around "
    "where the nose stood; these spheres should meet in the beacon. Pink: the source. What was before calibration is hidden at "
    "first.</figcaption>"
    "</figure>"
)


def run_report(folder: Path) -> tuple[str, Sequence[Drawing]]:
    """Return the page of the run in `folder`, and its figures. Raises BadInput where there is no run that is done."""
    material = Material.read(folder)
    drawn = drawings(material)
    published = yaml.load((CONF / "table_1.yaml").read_bytes(), Loader=SAFE)
    parts = [
        criteria_part(material),
        *(_figures(anchor, drawn[anchor], material) for anchor in HEADINGS if drawn[anchor] or anchor == "sensor"),
        calibration_part(material, published),
    ]
    parts += [part for part in (truth_part(material),) if part is not None]
    parts += [words_part(), assumptions_part(material), provenance_part(material)]
    title = f"OIO report: {headline(dict(material.identity), material.summary)}"
    scene = traces(material) if drawn["place"] else []
    figures = [*([scene_drawing(scene)] if scene else []), *(one for some in drawn.values() for one in some)]
    return page(title, lead(material), parts, scripts(scene) if scene else ""), figures


def _figures(anchor: str, drawn: Sequence[Drawing], material: Material) -> Part:
    shown = "".join(figure(one.name, one.svg(), one.caption) for one in drawn)
    before, after = SPACE if anchor == "place" else "", sensor_table(material) if anchor == "sensor" else ""
    return Part(anchor, HEADINGS[anchor], f'{before}<div class="figures">{shown}</div>{after}')
