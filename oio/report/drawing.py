"""Figures as SVG text for the page, and as SVG and PNG files: the same drawing, the same bytes for the same run."""

import io
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from oio.core.errors import BadInput
from oio.figures.style import RC

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PNG_DPI = 150
WIDE_IN = 5.6  # of a figure: two stand side by side on a wide screen, and one can be read on a narrow one
TAG = re.compile(r"<[^>]*>")
DECIMALS = re.compile(r"(\d\.\d\d)\d+")  # a hundredth of a point is enough, and a third smaller
SVG: Any = {
    "svg.fonttype": "none", "svg.hashsalt": "oio", "font.family": "sans-serif", "font.sans-serif": ["DejaVu Sans"],
    "path.simplify": True, "path.simplify_threshold": 0.3,
}  # fmt: skip


@dataclass(frozen=True)
class Drawing:
    """A figure to be drawn: its name, size in inches, caption, and the function that draws on it."""

    name: str
    size_in: tuple[float, float]
    caption: str
    draw: Callable[["Figure"], None]

    def svg(self) -> str:
        """Return the SVG element, without XML headers, so that it can stand in a page."""
        text = self._saved("svg").decode()
        element = TAG.sub(lambda tag: DECIMALS.sub(r"\1", tag.group()), text[text.index("<svg") :])  # and not in what is written
        return element.replace("<svg ", '<svg role="img" aria-hidden="true" ', 1)

    def save(self, folder: Path) -> None:
        """Write NAME.svg and NAME.png; raises BadInput where that cannot be."""
        try:
            folder.mkdir(parents=True, exist_ok=True)
            for kind in ("svg", "png"):
                (folder / f"{self.name}.{kind}").write_bytes(self._saved(kind))
        except OSError as error:
            raise BadInput(f"--figures is {folder}, but that cannot be written ({error.strerror}). Give another folder.") from None

    def _saved(self, kind: str) -> bytes:
        import matplotlib as mpl  # here: the import takes most of a second
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.backends.backend_svg import FigureCanvasSVG
        from matplotlib.figure import Figure

        out = io.BytesIO()
        with mpl.rc_context({**RC, **SVG}):
            drawn = Figure(figsize=self.size_in, dpi=PNG_DPI, layout="constrained")
            canvas: Any = FigureCanvasSVG(drawn) if kind == "svg" else FigureCanvasAgg(drawn)
            self.draw(drawn)
            # by the canvas itself: `savefig` draws everything twice
            canvas.print_svg(out, metadata={"Date": None}) if kind == "svg" else canvas.print_png(out, metadata={"Software": None})
        return out.getvalue()
