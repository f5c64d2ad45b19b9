"""Units in files of other programs, as factors to m, s, m/s and ppm."""

from oio.core.errors import BadInput

UNITS = {  # the first of each kind is our own
    "length": {"m": 1.0, "metre": 1.0, "meter": 1.0, "metres": 1.0, "meters": 1.0, "cm": 1e-2, "mm": 1e-3},
    "time": {"s": 1.0, "sec": 1.0, "second": 1.0, "seconds": 1.0, "min": 60.0, "minute": 60.0, "minutes": 60.0,
             "h": 3600.0, "hour": 3600.0, "hours": 3600.0, "ms": 1e-3, "milliseconds": 1e-3},
    "speed": {"m/s": 1.0, "m s-1": 1.0, "m s^-1": 1.0, "m s**-1": 1.0, "m.s-1": 1.0, "cm/s": 1e-2, "cm s-1": 1e-2, "mm/s": 1e-3},
    "concentration": {"ppm": 1.0, "ppmv": 1.0, "ppb": 1e-3, "1": 1e6, "mol/mol": 1e6, "mol mol-1": 1e6, "%": 1e4, "percent": 1e4},
}  # fmt: skip


def factor(kind: str, unit: str, where: str) -> float:
    """Return what a value in this unit is multiplied by; raises BadInput, beginning with `where`, for an unknown unit."""
    known = UNITS[kind]
    if unit not in known:
        raise BadInput(f"{where} has the unit '{unit}', but a {kind} is in {', '.join(known)}.")
    return known[unit]
