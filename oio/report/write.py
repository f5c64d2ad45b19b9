"""A report to its file: of a run or of a sweep, whichever the folder holds."""

from pathlib import Path

from oio.cli.io_errors import FULL
from oio.core.errors import BadInput
from oio.report.run_report import run_report
from oio.report.sweep_report import sweep_report
from oio.sweep.manifest import MANIFEST

NAME = "report.html"


def write_report(folder: Path, out: Path | None = None, figures: Path | None = None) -> Path:
    """Write the report of a run or a sweep, and its figures if a folder is given; returns its path. Raises BadInput for a wrong folder."""
    if not folder.is_dir():
        raise BadInput(f"{folder} was given, but there is no such folder. Give that of a run or a sweep, e.g. outputs/DATE/TIME_ec_5dof.")
    path = out or folder / NAME
    text, drawings = sweep_report(folder) if (folder / MANIFEST).is_file() else run_report(folder)
    for drawing in drawings if figures else ():
        drawing.save(figures or folder)
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        if error.errno in FULL and path.is_file():
            path.unlink()  # it is cut
        raise BadInput(
            f"{path} cannot be written ({error.strerror}). Type --out FILE.html, in a folder that exists and has room."
        ) from None
    return path
