"""The part of calibration.yaml from which a filter starts again: the fit on the beacon, both assemblies of Q and R, the baselines."""

from collections.abc import Mapping

from oio.inference.uncertainty import Noise
from oio.results.calibration import Calibration, MapCalibration

SCHEMA = "oio.results.calibration/1"
FITTED = ("nose_jitter_m", "model_discrepancy")  # of the range law: what calibration chose
FIXED = ("r_ref_m", "radius_m")  # without which the other parameters mean nothing


def parameter_names(joints: tuple[str, ...], elements: int) -> tuple[str, ...]:
    """Names of the parameters theta of a fit (P,), in order."""
    law = ("source_x", "source_y", "source_z", "ln_strength", "exponent", "wind_x", "wind_y", "wind_z", "thinning")
    arm = tuple(f"{what}_{joint}" for what in ("offset", "drift") for joint in joints)
    each = range(elements)
    return (*law, *arm, *(f"ln_gain_{e}" for e in each), "ln_lag_factor", *(f"baseline_{e}" for e in each))


def parameter_units(joint_units: tuple[str, ...], elements: int) -> tuple[str, ...]:
    """Unit of each parameter (P,), for joints whose positions are in these units, rad or m."""
    law = ("m", "m", "m", "ln(ppm)", "1", "1/m", "1/m", "1/m", "1/m")
    return (*law, *joint_units, *(f"{unit}/s^2" for unit in joint_units), *["1"] * elements, "1", *["ppm"] * elements)


def fit_entries(
    calibration: Calibration, found: MapCalibration, noises: dict[str, Noise], holds_for: Mapping[str, str | None]
) -> dict[str, object]:
    """Sections of calibration.yaml that `oio.results.kept_calibration` reads back to the last bit."""
    fit, arm = found.fit, calibration.chosen.model.arm
    return {
        "holds_for": {**holds_for, "joints": list(arm.names)},
        "fit": {
            "parameters": list(parameter_names(arm.names, fit.layout.elements)),
            "units": list(parameter_units(arm.units, fit.layout.elements)),
            "readings": fit.readings,
            "mean": [float(v) for v in fit.mean],
            "cov": [[float(v) for v in row] for row in fit.cov],
            "fluctuation": {
                "scale": float(fit.fluctuation.scale),
                "gamma": float(fit.fluctuation.gamma),
                "t_s": float(fit.fluctuation.t_s),
                "sway": float(fit.fluctuation.sway),
                "sway_s": float(fit.fluctuation.sway_s),
            },
            "law": {name: float(getattr(fit.law, name)) for name in (*FIXED, *FITTED)},
            "delay": {"s": float(found.delay.s), "u_s": float(found.delay.u_s)},
        },
        "assemblies": {name: _noise(noise) for name, noise in noises.items()},
        "baselines": [
            {"ppm": b.ppm, "sigma_ppm": b.sigma_ppm, "highest_ppm": b.highest_ppm, "n": b.n, "n_effective": b.n_effective}
            for b in calibration.baselines
        ],
        "highest_ppm": [float(v) for v in found.highest_ppm],
        "totals": {"time_s": calibration.time_s, "error_ppm": calibration.error_ppm, "moves": calibration.moves},
    }


def _noise(noise: Noise) -> dict[str, object]:
    r = None if noise.r_ppm2 is None else float(noise.r_ppm2)
    p0 = {"source_q_m2": float(noise.source_q_m2), "r_ppm2": r, "source_p0_m2": float(noise.source_p0_m2)}
    return {**p0, "measurements": int(noise.measurements), "inflation": float(noise.inflation)}
