"""Parameters that calibration fitted together, with their covariance: what `filter.P0_prior_parameters` of calibration.yaml tells.

Its rows are (s (3) | l | n | k (3) | u | o (dof) | a (dof) | ln g (E) | ln tau | b (E)), as in `oio.inference.forward_model`. Left out are
the source and ln strength, which are reset for the next source; the gain of element 0, which is 1 by definition; and the offsets b, whose
entries are of the baseline stage alone.
"""

import numpy as np

from oio.core.errors import BadInput
from oio.core.records import Array
from oio.results.calibration_entries import CalibrationEntries

LAW = 9  # parameters before the joints


def fitted_keys(entries: CalibrationEntries) -> tuple[str, ...]:
    """Return the keys of the n quantities that were fitted together, in the order of the covariance."""
    law = [f"range_law.{name}" for name in ("exponent", "wind_x", "wind_y", "wind_z", "thinning")]
    joints = [f"arm.{joint}.{name}" for name in ("offset", "drift") for joint in entries.joints]
    return (*law, *joints, *(f"sensor.element_{e}.gain" for e in range(1, entries.elements)), "sensor.tau_rise")


def fitted(entries: CalibrationEntries) -> tuple[Array, Array] | None:
    """Return the fitted parameters (n,), in the filter's units, and their covariance (n, n); None where the file has no such matrix."""
    stored = entries.document.get("filter")
    rows = stored.get("P0_prior_parameters") if isinstance(stored, dict) else None
    keys, size = fitted_keys(entries), LAW + 2 * len(entries.joints) + 2 * entries.elements + 1
    if rows is None or any(key not in entries.quantities for key in keys):
        return None
    cov = _matrix(rows, size, entries.name)
    if cov is None:
        return None
    at = [4, *range(5, LAW + 2 * len(entries.joints)), *range(size - 2 * entries.elements, size - entries.elements)]
    return np.array([_parameter(key, entries.quantities[key].value) for key in keys]), cov[np.ix_(at, at)]


def _parameter(key: str, value: float) -> float:
    if key.startswith("arm."):
        return float(np.radians(value))
    return float(np.log(value)) if key.startswith("sensor.") and value > 0.0 else value


def _matrix(rows: object, size: int, name: str) -> Array | None:
    """The matrix (size, size); None for one of another size, which another layout has."""
    try:
        cov = np.array(rows, dtype=np.float64)
    except (TypeError, ValueError):
        cov = np.array(np.nan)
    if not np.all(np.isfinite(cov)):
        raise BadInput(f"{name}: filter.P0_prior_parameters must be a square matrix of finite numbers.")
    if cov.shape != (size, size):
        return None
    sd = np.sqrt(np.maximum(np.diag(cov), np.finfo(np.float64).tiny))
    correlation = cov / np.outer(sd, sd)
    if not np.allclose(correlation, correlation.T, rtol=0.0, atol=1e-6) or np.min(np.linalg.eigvalsh(correlation)) <= 0.0:
        raise BadInput(f"{name}: filter.P0_prior_parameters must be a covariance: symmetric and positive definite.")
    return cov
