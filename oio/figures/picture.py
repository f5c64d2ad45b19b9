"""Figure of a run: the search from above, and three time series."""

from pathlib import Path
from typing import TYPE_CHECKING

from oio.core.errors import BadInput
from oio.figures.error_timelines import nose_error, source_error
from oio.figures.gas_timeline import gas
from oio.figures.run_history import read_run_history
from oio.figures.search_map import search_map
from oio.figures.style import RC
from oio.figures.titles import ending, headline, read_summary

if TYPE_CHECKING:
    from matplotlib.backends.backend_agg import FigureCanvasAgg

SIZE_IN, DPI = (16.0, 9.0), 100  # 1600 x 900 pixels
PLACES = {  # left, bottom, width, height: fixed, so that every run has the same layout, with room for legends
    "map": (0.06, 0.075, 0.39, 0.7),
    "source": (0.52, 0.715, 0.47, 0.2),
    "gas": (0.52, 0.395, 0.47, 0.2),
    "nose": (0.52, 0.075, 0.47, 0.2),
}


def draw(run: Path, out: Path) -> None:
    """Draw `run`/run.mcap, with the results of `run`/summary.json if it is there, to the PNG `out`; raises BadInput if it cannot."""
    import matplotlib as mpl  # here: the import takes a second, and `--help` does without
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    if out.suffix != ".png":
        raise BadInput(f"--out is {out}, but a picture is a PNG. Type e.g. --out {out.with_suffix('.png')}")
    story, summary = read_run_history(_log(run)), read_summary(run / "summary.json")
    with mpl.rc_context(RC):
        figure = Figure(figsize=SIZE_IN, dpi=DPI)
        canvas = FigureCanvasAgg(figure)
        panels = {name: figure.add_axes(place) for name, place in PLACES.items()}
        search_map(panels["map"], story, 3)
        source_error(panels["source"], story, 4)
        gas(panels["gas"], story)
        nose_error(panels["nose"], story, summary, 3)
        figure.text(0.06, 0.955, headline(dict(story.identity), summary), fontsize=16, weight="bold")
        figure.text(0.06, 0.92, ending(summary), fontsize=14)
        _save(canvas, out)


def _log(run: Path) -> Path:
    """Log of a run; the unfinished one of a killed run, if there is no other, so that the error names the recovery command."""
    finished, part = run / "run.mcap", run / "run.mcap.part"
    return part if part.is_file() and not finished.is_file() else finished


def _save(canvas: "FigureCanvasAgg", out: Path) -> None:
    try:
        canvas.figure.savefig(out, metadata={"Software": None})  # no version: the same run gives the same bytes
    except OSError as error:
        raise BadInput(f"--out is {out}, but that cannot be written ({error.strerror}). Give a file in a folder that exists.") from None
