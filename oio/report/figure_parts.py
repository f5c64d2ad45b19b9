"""Parts with figures: where the source is, the readings with their bouts, the consistency of the filter, the nose."""

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from oio.figures.bout_signal import bout_signal
from oio.figures.consistency import nis_strip, residual_histogram, residual_strip
from oio.figures.error_timelines import error_over_bound, source_error
from oio.figures.nose_tracks import nose_tracks
from oio.figures.search_map import search_map
from oio.report.captions import CAPTIONS
from oio.report.drawing import WIDE_IN, Drawing
from oio.report.material import Material
from oio.report.numbers_part import LARGEST_BOUND_M
from oio.report.sensor_part import sensor_drawings

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def drawings(material: Material) -> dict[str, list[Drawing]]:
    """Return the figures of each part, by its anchor; a part without anything to draw has none."""
    story, innovations = material.story, material.innovations
    nose = Drawing(
        "nose",
        (WIDE_IN, 6.4),
        CAPTIONS["nose" if len(story.truth) else "nose_without_truth"],
        lambda f: nose_tracks(f, story, material.summary),
    )
    search = _drawing("search", 5.6, lambda f: search_map(f.subplots(), story))
    error = _drawing("source_error", 3.4, lambda f: source_error(f.subplots(), story))
    found = np.array(material.stages.get("evaluate", {}).get("bounds") or np.zeros((0, 2)))
    bounds = found[found[:, 1] < LARGEST_BOUND_M]
    over_bound = _drawing("error_over_bound", 3.0, lambda f: error_over_bound(f.subplots(), story, bounds))
    readings = _drawing("readings", 3.2, lambda f: bout_signal(f.subplots(), story, material.bouts(), material.baselines_ppm()))
    nis = _drawing("nis", 3.2, lambda f: nis_strip(f.subplots(), innovations))
    residuals = _drawing("residuals", 3.2, lambda f: _residuals(f, material))
    return {
        "place": [
            *([search] if material.moved else []),
            *([error] if len(story.source) and "source" in story.places else []),
            *([over_bound] if len(bounds) and len(story.source) else []),
        ],
        "signal": [readings] if story.readings else [],
        "sensor": sensor_drawings(material),
        "filter": [nis, residuals] if innovations else [],
        "nose": [nose] if len(story.odometry) else [],
    }


def _drawing(name: str, tall_in: float, draw: "Callable[[Figure], None]") -> Drawing:
    return Drawing(name, (WIDE_IN, tall_in), CAPTIONS[name], draw)


def _residuals(figure: "Figure", material: Material) -> None:
    strip, histogram = figure.subplots(1, 2, width_ratios=[3, 1], sharey=False)
    residual_strip(strip, material.innovations)
    residual_histogram(histogram, material.innovations)
