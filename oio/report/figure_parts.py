"""Parts with figures: where the source is, the readings with their bouts, the consistency of the filter, the nose."""

from typing import TYPE_CHECKING

from oio.figures.bout_signal import bout_signal
from oio.figures.consistency import nis_strip, residual_histogram, residual_strip
from oio.figures.nose_tracks import nose_tracks
from oio.figures.search_map import search_map
from oio.figures.timelines import source_error
from oio.report.drawing import Drawing
from oio.report.material import Material
from oio.report.sensor_part import sensor_drawings

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def drawings(material: Material) -> dict[str, list[Drawing]]:
    """Return the figures of each part, by its anchor."""
    return {
        "place": [
            Drawing("search", (9.0, 7.0), "The search from above, with the 95 % region of the source.", lambda f: _from_above(f, material)),
            Drawing(
                "source_error", (9.0, 3.2), "Error of the believed source (where the true place is known), with two standard deviations.",
                lambda f: source_error(f.subplots(), material.story),
            ),
        ],
        "signal": [
            Drawing(
                "readings", (9.0, 3.6), "Readings of each element in ppm; dotted: baselines; triangles: bouts of the calibration.",
                lambda f: bout_signal(f.subplots(), material.story, material.bouts(), material.baselines_ppm()),
            )
        ],
        "sensor": sensor_drawings(material),
        "filter": [
            Drawing(
                "nis", (9.0, 3.2), "Normalised innovation squared of the search: about 1 on average if Q and R are right.",
                lambda f: nis_strip(f.subplots(), material.innovations),
            ),
            Drawing(
                "residuals", (9.0, 3.2), "Innovations in their own standard deviations; 99.7 % lie within three if the filter is right.",
                lambda f: _residuals(f, material),
            ),
        ],
        "nose": [
            Drawing(
                "nose", (9.0, 5.4), "The nose per axis, by the encoders (before calibration) and by the filter; in simulation its error.",
                lambda f: nose_tracks(f, material.story),
            )
        ],
    }  # fmt: skip


def _from_above(figure: "Figure", material: Material) -> None:
    search_map(figure.subplots(), material.story)


def _residuals(figure: "Figure", material: Material) -> None:
    strip, histogram = figure.subplots(1, 2, width_ratios=[3, 1], sharey=False)
    residual_strip(strip, material.innovations)
    residual_histogram(histogram, material.innovations)
