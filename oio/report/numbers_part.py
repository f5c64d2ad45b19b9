"""Numbers of the calibration with their uncertainties, the paper's Table I beside ours, and in simulation the score against the truth."""

from collections.abc import Iterator
from typing import Any

from oio.figures.rounding import with_uncertainty
from oio.report.material import Material
from oio.report.page import Part, badge, bullets, paragraph, table

NO_BREAK = "\N{NO-BREAK SPACE}"
LARGEST_BOUND_M = 0.5  # a larger one is no bound on anything
VARIANTS = {
    "cold": "cold start: data sheet taken as known", "cold_open": "cold start: data sheet, open",
    "calibrated": "calibrated", "calibrated_paper_assembly": "with the paper's Q and R",
}  # fmt: skip
SECTIONS = {"sensor": "sensor", "range_law": "air", "arm": "arm"}


def calibration_part(material: Material, published: dict[str, Any]) -> Part:
    """Return the table of every calibrated quantity, and Table I."""
    rows = [row for section, about in SECTIONS.items() for row in _entries(material.calibration.get(section) or {}, about)]
    if not rows:
        return Part("calibration", "Calibration", paragraph("This run made no calibration."))
    heads = ("quantity", "value +- u", "degrees of freedom", "type")
    caption = "Calibrated quantities with their standard uncertainty u"
    meaning = (
        "Type A: from the readings of this run. B: from elsewhere, also where the readings told less than was known before; "
        "u is then mostly what was known before."
    )
    values = table(caption, heads, rows) + paragraph(meaning, "note")
    return Part("calibration", "Calibration", values + _table_1(material, published))


def _entries(tree: dict[str, Any], key: str) -> Iterator[tuple[str, ...]]:
    for name, value in tree.items():
        if isinstance(value, dict) and {"value", "u", "unit"} <= set(value):
            dof, unit = value.get("dof"), str(value["unit"])
            known = all(isinstance(number, int | float) for number in (value["value"], value["u"]))
            measured = with_uncertainty(value["value"], value["u"]) if known else f"{value['value']}"
            with_unit = measured if unit == "1" else f"{measured}{NO_BREAK}{unit}"
            yield f"{key}.{name}", with_unit, "infinite" if dof is None else _plain(dof), str(value.get("method", ""))
        elif isinstance(value, dict):
            yield from _entries(value, f"{key}.{name}")


def _plain(dof: object) -> str:
    return f"{dof:g}" if isinstance(dof, int | float) else str(dof)


def _table_1(material: Material, published: dict[str, Any]) -> str:
    made, paper = material.summary.get("calibration"), published.get(str(material.summary.get("sensor")))
    if not made or not paper:
        return ""
    rows = [
        ("calibration time (s)", f"{made['time_s']:.0f}", f"{paper['time_s']:g}"),
        ("error (ppm)", f"{made['error_ppm']:.2g}", f"{paper['error_ppm']:g}"),
    ]
    note = "The error is the claimed standard uncertainty of a reading; what the paper's is an error of, it does not say."
    return table("The paper's Table I beside this run", ("quantity", "this run", "paper"), rows) + paragraph(note, "note")


def truth_part(material: Material) -> Part | None:
    """Return what only simulation knows; None without a truth."""
    summary = material.summary
    scored = summary.get("scored")
    if not scored or scored["word"] == "unknown":
        return None
    rows = [_row(name, summary[key]) for key, name in VARIANTS.items() if summary.get(key)]
    heads = ("filter", "source error (mm)", "+- (mm)", "nose error (mm)", "NEES", "in its 95 % region", "mean NIS", "declared")
    words = f"<p>{badge(scored['word'])} The answer compared with the truth. None of this enters the verdict.</p>"
    ratio = summary.get("bound_ratio") if (summary.get("bound_m") or 0.0) < LARGEST_BOUND_M else None
    bound = (
        paragraph(f"Error over the Cramer-Rao bound of this path: {ratio:.2f}; 1 is the best on average, a lucky search has less.")
        if ratio
        else ""
    )
    reasons = bullets(scored["reasons"]) if scored["reasons"] else ""
    return Part(
        "truth",
        "Scored against the true place of the source",
        f'<div class="truth">{words}{reasons}{bound}{table("The same samples through each filter", heads, rows, cards=True)}</div>',
    )


def _row(name: str, outcome: dict[str, Any]) -> tuple[str, ...]:
    inside = {True: "yes", False: "no", None: "-"}[outcome.get("inside_95")]
    missed = (
        _mm(outcome.get("source_error_m"))
        if outcome.get("source_error_m") is not None
        else f"bearing {outcome.get('bearing_error_deg', 0):.1f} deg"
    )
    nees, nis = (f"{v:.2f}" if v is not None else "-" for v in (outcome.get("nees_source"), outcome.get("nis_mean")))
    return (
        name,
        missed,
        _mm(outcome.get("sd_m")),
        _mm(outcome.get("nose_error_m")),
        nees,
        inside,
        nis,
        "yes" if outcome.get("found") else "no",
    )


def _mm(value: float | None) -> str:
    return "-" if value is None else f"{1e3 * value:.1f}"
