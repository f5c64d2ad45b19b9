"""Air in an NPZ (`numpy.savez`).

`t_s` (T,); `x_m` (X,), `y_m` (Y,), `z_m` (Z,) with equal steps; `wind_m_s` (T, X, Y, Z, 3), `ppm` (T, X, Y, Z) or both. Instead of `ppm`,
puffs: `puff_frame` (n,) the index into t_s, `puff_m` (n, 3), `puff_sigma_m` (n,), `puff_ml` (n,) pure gas in each. With gas: `source_m`
(3,) and `rate_ml_s`, its emission.
"""

from pathlib import Path

import numpy as np

from hardware.air.air_recording import AirRecording, Puffs, bad_file, checked_axis, checked_recording, checked_series
from oio.core.records import Array


def read_npz(path: Path) -> AirRecording:
    """Read an NPZ; raises BadInput that names the key."""
    try:
        with np.load(path, allow_pickle=False) as archive:
            data = {key: archive[key] for key in archive.files}
    except (OSError, ValueError, KeyError, EOFError) as error:
        raise bad_file(path, f"it is no NPZ of plain arrays ({error})") from None
    t_s = checked_axis(path, data, "t_s")
    wind = gas = None
    if "wind_m_s" in data or "ppm" in data:
        axes = [checked_axis(path, data, f"{axis}_m") for axis in "xyz"]
        wind = checked_series(path, "wind_m_s", data["wind_m_s"], t_s, axes, 3) if "wind_m_s" in data else None
        gas = checked_series(path, "ppm", data["ppm"], t_s, axes, 1) if "ppm" in data else None
    puffs = _puffs(path, data, t_s) if "puff_m" in data else None
    source, rate = data.get("source_m"), data.get("rate_ml_s")
    return checked_recording(path, wind, gas if puffs is None else puffs, source, rate)


def _puffs(path: Path, data: dict[str, Array], t_s: Array) -> Puffs:
    missing = [key for key in ("puff_frame", "puff_sigma_m", "puff_ml") if key not in data]
    if missing:
        raise bad_file(path, f"it has no '{missing[0]}'")
    frame, place, sigma, amount = (np.asarray(data[key]) for key in ("puff_frame", "puff_m", "puff_sigma_m", "puff_ml"))
    n = len(frame)
    if place.shape != (n, 3) or sigma.shape != (n,) or amount.shape != (n,):
        raise bad_file(path, f"puff_m must be ({n}, 3), puff_sigma_m and puff_ml ({n},), as puff_frame has {n} entries")
    if not np.issubdtype(frame.dtype, np.integer) or (n and (np.any(frame < 0) or np.any(frame >= len(t_s)))):
        raise bad_file(path, f"puff_frame must be indices into t_s, 0 to {len(t_s) - 1}")
    if not (np.all(np.isfinite(place)) and np.all(sigma > 0.0) and np.all(amount >= 0.0)):
        raise bad_file(path, "puffs have a place that is not finite, a puff_sigma_m that is not above 0, or a negative puff_ml")
    order = np.argsort(frame, kind="stable")
    return Puffs(t_s, np.searchsorted(frame[order], np.arange(len(t_s) + 1)), place[order].astype(float), sigma[order], amount[order])
