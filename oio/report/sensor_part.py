"""The sensor alone: noise and drift of its readings in clean air (Allan deviation), and its response to a step."""

from oio.core.errors import NotObservable
from oio.figures.allan_plot import allan_plot
from oio.figures.step_plot import Lag, step_plot
from oio.identification.allan import allan_curve
from oio.identification.allan_fit import AllanFit, fit_allan
from oio.identification.regular_series import regular
from oio.report.captions import CAPTIONS
from oio.report.drawing import WIDE_IN, Drawing
from oio.report.material import Material
from oio.report.page import paragraph, table

HEADS = ("element", "quantity", "value", "95 % interval", "unit")
FEWEST = 12  # readings, as many as the clean air of a default run has at least: they tell white noise, within a factor of two
MEANING = {"N": "white noise", "B": "bias instability", "K": "random walk", "R": "drift"}


def sensor_drawings(material: Material) -> list[Drawing]:
    """Return the figures: no Allan deviation where the record is too short for one."""
    fits = allan_fits(material)[0]
    lags = [_lag(material, name) for name in ("tau_rise", "tau_fall")]
    allan = Drawing("allan", (WIDE_IN, 3.4), CAPTIONS["allan"], lambda f: allan_plot(f.subplots(), fits, "ppm"))
    step = Drawing("step", (WIDE_IN, 3.2), CAPTIONS["step"], lambda f: step_plot(f.subplots(), *lags))
    return [*([allan] if fits else ()), *([step] if all(lags) else ())]


def sensor_table(material: Material) -> str:
    """Return noise and drift of every element with intervals, and why there are none where there are none."""
    fits, refused = allan_fits(material)
    rows = [
        (
            element,
            f"{MEANING[name]} {name}",
            "cannot be told from 0" if c.value is None else f"{c.value:.3g}",
            _interval(c.low, c.high),
            c.unit,
        )
        for element, fit in fits.items()
        for name, c in fit.coefficients.items()
    ]
    reasons = {why: ", ".join(element for element, other in refused.items() if other == why) for why in refused.values()}
    notes = "".join(paragraph(f"No Allan deviation of {elements}: {why}", "note") for why, elements in reasons.items())
    more = paragraph(
        "A run's minutes tell white noise; drift wants an hour: stage.warm_up.drift_record_s=3600. Also: python -m oio.identify RUN.",
        "note",
    )
    return (table("Noise and drift in clean air", HEADS, rows) if rows else "") + notes + more


def allan_fits(material: Material) -> tuple[dict[str, AllanFit], dict[str, str]]:
    """Return the fit of each element whose record allows one, and the reason for each of the others."""
    fits, refused = dict[str, AllanFit](), dict[str, str]()
    for name, (t_s, ppm) in material.clean_air().items():
        try:
            fits[name] = fit_allan(allan_curve(regular(t_s, ppm, FEWEST)))
        except NotObservable as reason:
            refused[name] = str(reason)
    return fits, refused


def _interval(low: float, high: float) -> str:
    return f"{low:.3g} to {high:.3g}"


def _lag(material: Material, name: str) -> Lag | None:
    entry = (material.calibration.get("sensor") or {}).get(name)
    return (float(entry["value"]), float(entry["u"])) if isinstance(entry, dict) and {"value", "u"} <= set(entry) else None
