"""What was found, as lines in the terminal, and as files: location.json, location.png, calibration.yaml."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from oio import __version__
from oio.api.calibration_file import write_calibration
from oio.api.location import OF_CALIBRATION, Location, own_words
from oio.cli import terminal
from oio.cli.hanging_text import print_hanging
from oio.core.records import Array
from oio.localise.asked import Asked
from oio.localise.found import Found
from oio.localise.picture import draw

SCHEMA = "oio.localise/1"


def show(given: Asked, found: Found) -> None:
    """Print what was read, what was found, and whether to trust it."""
    console = terminal.console(soft_wrap=True, highlight=False)
    readings = found.log.readings
    used = "" if found.readings is None else f"; {len(found.readings)} of them searched by"
    console.print(f"{given.file.name}: {len(readings)} readings over {_length_s(readings.t_s):.0f} s{used}", markup=False)
    for note in (*found.log.notes, *(f"{count} rows dropped: {why}" for why, count in found.log.dropped.items() if count)):
        print_hanging(console, "  - ", note)
    if found.calibration and not given.calibration:
        print_hanging(console, "calibration: ", f"verdict {found.calibration.verdict}")
        for reason in found.calibration.reasons:
            print_hanging(console, "  - ", own_words(reason))
    if found.calibration and found.calibration.delay_s:
        late_s = found.calibration.delay_s
        what = "readings" if late_s > 0.0 else "positions"
        print_hanging(console, "clock: ", f"{what} are stamped {abs(late_s):.2f} s late, and were taken where the nose was then.")
    if found.location:
        _show_location(found.location, given.calibration is None)


def _show_location(where: Location, calibration_shown: bool) -> None:
    console = terminal.console(soft_wrap=True, highlight=False)
    console.print(f"source: {_place(where.mean_m)}, standard deviations {_mm(np.sqrt(np.diag(where.cov_m2)))} mm", markup=False)
    for mean_m, cov_m2 in where.others:
        console.print(f"or:     {_place(mean_m)}, standard deviations {_mm(np.sqrt(np.diag(cov_m2)))} mm", markup=False)
    console.print(f"verdict: {where.verdict}", markup=False)
    for reason in (reason for reason in where.reasons if not (calibration_shown and reason.startswith(OF_CALIBRATION))):
        print_hanging(console, "  - ", reason)


def save(given: Asked, found: Found, folder: Path) -> None:
    """Write all that was found to a folder."""
    written = []
    if found.calibration and not given.calibration:
        write_calibration(found.calibration, folder / "calibration.yaml")
        written.append("calibration.yaml")
    if found.location:
        (folder / "location.json").write_text(json.dumps(_plain(given, found, found.location), indent=2) + "\n", encoding="utf-8")
        draw(found, found.location, folder / "location.png")
        written += ["location.json", "location.png"]
    terminal.console(soft_wrap=True, highlight=False).print(f"{folder}: {', '.join(written)}", markup=False)


def _plain(given: Asked, found: Found, where: Location) -> dict[str, Any]:
    return {
        "schema": SCHEMA,
        "version": __version__,
        "log": given.file.name,
        "setup": found.setup.words,
        "calibrated": found.calibration is not None,
        "read_off_the_file": list(found.log.notes),
        "dropped_rows": dict(found.log.dropped),
        "mean_m": where.mean_m.tolist(),
        "cov_m2": where.cov_m2.tolist(),
        "others": [{"mean_m": mean.tolist(), "cov_m2": cov.tolist()} for mean, cov in where.others],
        "world": where.world,
        "verdict": where.verdict,
        "reasons": list(where.reasons),
    }


def _length_s(t_s: Any) -> float:
    return float(np.ptp(np.asarray(t_s)))


def _place(mean_m: Array) -> str:
    return "x {:.3f}, y {:.3f}, z {:.3f} m".format(*mean_m)


def _mm(sd_m: Array) -> str:
    return ", ".join(f"{1e3 * value:.0f}" for value in sd_m)
