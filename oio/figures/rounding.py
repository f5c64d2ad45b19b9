"""Numbers with their standard uncertainty, rounded as in the GUM (7.2.6): the uncertainty to two digits, the value as far as it goes."""

import math

DIGITS = 2
PLAIN = (1e-4, 1e5)  # uncertainties in between are written without an exponent


def rounded(value: float, u: float) -> tuple[str, str]:
    """Return both as text with as many decimals as the uncertainty has, e.g. ("2.350", "0.034"). Without one: four digits, and "0"."""
    if not (math.isfinite(value) and math.isfinite(u)) or u <= 0.0:
        return f"{value:.4g}", f"{u:.2g}"
    if not PLAIN[0] <= u < PLAIN[1]:
        return f"{value:.4g}", f"{u:.1e}"
    decimals = max(DIGITS - 1 - math.floor(math.log10(float(f"{u:.1e}"))), 0)
    text = f"{value:.{decimals}f}"
    return text if float(text) else text.lstrip("-"), f"{u:.{decimals}f}"


def with_uncertainty(value: float, u: float) -> str:
    """Return e.g. `2.350 \N{PLUS-MINUS SIGN} 0.034`, with no break after the sign."""
    return " \N{PLUS-MINUS SIGN}\N{NO-BREAK SPACE}".join(rounded(value, u))
