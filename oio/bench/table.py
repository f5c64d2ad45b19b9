"""Table of the accuracy benchmark on the screen."""

import math
from collections.abc import Mapping

from rich.markup import escape

from oio.bench.case_summary import Row
from oio.bench.score import Case
from oio.cli import terminal
from oio.cli.table_layout import print_table

HEADS = (
    "n\n(failed)", "error [mm]\nmedian / 90 / 95 %", "in 95 %\nregion [%]", "ANEES\n(band)", "RMSE /\nbound",
    "filter alone\n[mm], ANEES", "moves",
    "declared\n[%], after", "false\n[%]", "cold / open [mm]\n(gain)", "calibrated\nwins", "nose [mm] /\ndead reck.", "cal. [s]\n(paper)",
    "error [ppm]\n(paper)",
)  # fmt: skip


def show(rows: Mapping[Case, Row], failures: Mapping[str, int], where: str) -> None:
    """Print all cases, the reasons of failures, and the output folder."""
    varying = [name for name in Case._fields if name in ("sensor", "air", "dof") or len({getattr(case, name) for case in rows}) > 1]
    shown = [[*(str(getattr(case, name)) for name in varying), *_cells(row)] for case, row in rows.items()]
    print_table(
        terminal.console(), "source error over seeds, calibrated; brackets are 95 % intervals", (*varying, *HEADS), shown, len(varying)
    )
    console = terminal.console(soft_wrap=True)
    for reason, count in failures.items():
        console.print(f"{count} failed: {escape(reason)}")
    console.print(f"tables and figure are in {escape(where)}")


def _cells(r: Row) -> tuple[str, ...]:
    return (
        f"{r.trials} ({r.failed})", f"{_f(r.median_mm)} / {_f(r.p90_mm)} / {_f(r.p95_mm)}",
        f"{_percent(r.covered)} {_between(r.covered_low, r.covered_high)}",
        f"{_f(r.anees, 2)} ({_f(r.anees_low, 2)}-{_f(r.anees_high, 2)})", _f(r.over_bound, 2),
        f"{_f(r.filter_mm)}, {_f(r.filter_anees, 1)}", _f(r.moves, 0),
        f"{_percent(r.declared)}, {_f(r.declare_s, 0)} s / {_f(r.declare_moves, 0)}",
        f"{_percent(r.false)} {_between(r.false_low, r.false_high)}",
        f"{_f(r.cold_mm)} / {_f(r.cold_open_mm)} ({_f(r.gain)})", f"{r.wins} of {r.trials - r.failed}",
        f"{_f(r.nose_mm)} / {_f(r.dead_reckoning_mm)}",
        f"{_f(r.calibration_s, 0)} ({_f(r.paper_calibration_s, 0)})", f"{_f(r.error_ppm)} ({_f(r.paper_error_ppm, 0)})",
    )  # fmt: skip


def _f(value: float, digits: int = 1) -> str:
    return f"{value:.{digits}f}" if math.isfinite(value) else "-"


def _percent(share: float) -> str:
    return _f(100 * share, 0)


def _between(low: float, high: float) -> str:
    return f"[{_percent(low)}-{_percent(high)}]" if math.isfinite(low) else ""
