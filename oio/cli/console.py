"""The table of results at the end of a run."""

from collections.abc import Mapping
from typing import Any

from oio.cli import terminal
from oio.cli.hanging_text import print_hanging
from oio.cli.table_layout import print_table
from oio.cli.verdict_lines import show_verdict

OUTCOMES = {
    "cold": "cold start",
    "cold_open": "cold start, open",
    "calibrated": "calibrated",
    "calibrated_paper_assembly": "with the paper's Q, R",
}


def show_summary(document: Mapping[str, Any], where: str) -> None:
    """Print the table of one run: cold start against calibrated in mm, bounds, verdict."""
    console = terminal.console(soft_wrap=True)
    if document["calibrated"] is not None:
        world = f", world={document['world']}" if document.get("world") not in (None, "unchanged") else ""
        title = (
            f"{document['sensor']} ({document['profile']}), dof={document['dof']}, air={document['air']}{world}, seed={document['seed']}"
        )
        print_table(console, title, *_outcomes(document))
    calibration = document["calibration"]
    if calibration is not None:
        kept = f" of {calibration['kept']['file']}:" if "kept" in calibration else ""
        print_hanging(
            console, f"calibration{kept} ", f"{calibration['time_s']:.0f} s, {calibration['moves']} moves; "
            f"u_a {calibration['u_a_ppm']:.3g} ppm, u_b {1e3 * calibration['u_b_m']:.1f} mm, error {calibration['error_ppm']:.3g} ppm"
        )  # fmt: skip
    if document["bound_m"] is not None:
        print_hanging(console, "error / bound ", _bounds(document))
    show_verdict(console, document)
    scored = document.get("scored")
    if scored is not None and scored["word"] != "unknown":
        print_hanging(console, f"scored {scored['word']}, ", f"against the truth{_coverage(document)}")
        for reason in scored["reasons"]:
            print_hanging(console, "  - ", reason)
    console.print(where, markup=False)


def _coverage(document: Mapping[str, Any]) -> str:
    outcome = document["calibrated"]
    if outcome is None or outcome["inside_95"] is None:
        return ""
    return f": the 95 % region {'contains' if outcome['inside_95'] else 'misses'} the source"


def _bounds(document: Mapping[str, Any]) -> str:
    """The error over the Cramer-Rao bound of this path at this truth; beside it van Trees' bound, averaged over truths from the prior."""
    ratio, bound, posterior = number(document["bound_ratio"], 1.0, 2), number(document["bound_m"]), number(document["posterior_bound_m"])
    return f"{ratio} (Cramer-Rao {bound} mm; van Trees, the mean over sources anywhere but on this path, {posterior} mm)"


def _outcomes(document: Mapping[str, Any]) -> tuple[list[str], list[list[str]]]:
    """Heads and rows of the table of outcomes."""
    bearing = "bearing_error_deg" in document["calibrated"]
    error = "bearing error [deg]" if bearing else "source error [mm]"
    heads = ["", error, "+- [mm]", "nose error [mm]", "NEES", "in 95 %", "NIS", "moves", "time [s]", "declared"]
    rows = []
    for key, name in OUTCOMES.items():
        o = document.get(key)  # summaries of schema 1 have no open cold start
        if o is None:
            continue
        rows.append([name, *_outcome(o, bearing)])
        if key == "calibrated" and not bearing and o.get("filtered_error_m") is not None:
            alone = number(o["filtered_error_m"]), "", "", number(o["filtered_nees"], 1.0)
            rows.append(["  the filter alone", *alone, *[""] * 5])  # just before the last map, which is the answer of the row above
    return heads, [*rows, ["dead reckoning", "", "", number(document["dead_reckoning"]["nose_error_m"]), *[""] * 6]]


def _outcome(o: Mapping[str, Any], bearing: bool) -> list[str]:
    missed = number(o.get("bearing_error_deg"), 1.0) if bearing else number(o["source_error_m"])
    inside = {True: "yes", False: "no", None: "-"}[o["inside_95"]]
    return [
        missed, number(o["sd_m"]), number(o["nose_error_m"]), number(o["nees_source"], 1.0), inside,
        number(o["nis_mean"], 1.0, 2), str(o["moves"]), number(o["time_s"], 1.0), "yes" if o["found"] else "no",
    ]  # fmt: skip


def number(value: float | None, factor: float = 1e3, digits: int = 1) -> str:
    """Format a number, scaled by `factor` (metres to millimetres by default); a dash for None."""
    return "-" if value is None else f"{factor * value:.{digits}f}"
