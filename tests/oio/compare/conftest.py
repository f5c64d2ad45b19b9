"""Calibrations made up: an arm of two joints, a sensor of two elements, and parameters drawn about a truth."""

import copy

import numpy as np
import pytest
import yaml

from oio.results.calibration_entries import CalibrationEntries, calibration_entries

JOINTS, ELEMENTS = ("pan", "tilt"), 2
SIZE = 9 + 2 * len(JOINTS) + 2 * ELEMENTS + 1
TRUTH = {"exponent": 1.1, "wind_x": 0.5, "wind_y": -0.2, "wind_z": 0.0, "thinning": 0.3}


def _entry(value, u, unit, dof=100.0):
    return {"value": float(value), "u": float(u), "unit": unit, "dof": dof, "method": "A"}


class Specimen:
    """`calibrated(rng)` is one calibration of this specimen: a document whose errors have the covariance that it states."""

    def __init__(self, seed=0, correlation=0.6):
        rng = np.random.default_rng(seed)
        sd = np.concatenate([np.full(4, 0.1), np.full(5, 0.2), np.full(4, 0.005), [1e-6, 0.01, 0.03], np.full(ELEMENTS, 0.05)])
        root = rng.standard_normal((SIZE, SIZE)) * correlation / np.sqrt(SIZE) + np.eye(SIZE)
        cov = root @ root.T
        self.cov = cov * np.outer(sd, sd) / np.sqrt(np.outer(np.diag(cov), np.diag(cov)))
        self.theta = np.concatenate([np.zeros(3), [3.0], list(TRUTH.values()), rng.normal(0, 0.01, 4), [0.0, 0.25, 0.1], [2.0, 1.0]])

    def calibrated(self, rng):
        t = rng.multivariate_normal(self.theta, self.cov, method="cholesky") if rng else self.theta.copy()
        t[13] = 0.0
        u = np.sqrt(np.diag(self.cov))
        deg = np.degrees
        law = {name: _entry(t[4 + i], u[4 + i], "1" if i == 0 else "1/m") for i, name in enumerate(TRUTH)}
        arm = {
            joint: {"offset": _entry(deg(t[9 + j]), deg(u[9 + j]), "deg"), "drift": _entry(deg(t[11 + j]), deg(u[11 + j]), "deg/s^2")}
            for j, joint in enumerate(JOINTS)
        }
        gain, tau = np.exp(t[13:15]), np.exp(t[15])
        elements = {
            f"element_{e}": {
                "baseline": _entry(t[16 + e], u[16 + e], "ppm", 4.0), "gain": _entry(gain[e], gain[e] * u[13 + e], "1"),
                "R_white": _entry(0.01, 0.007, "ppm^2", 4.0),
            }
            for e in range(ELEMENTS)
        }  # fmt: skip
        timing = {"tau_rise": _entry(2 * tau, 2 * tau * u[15], "s"), "tau_fall": _entry(3 * tau, 3 * tau * u[15], "s")}
        return {
            "schema": "oio.results.calibration/1",
            "sensor": {**elements, **timing, "delay": _entry(0, 0, "s"), "error": _entry(0.5, 0.01, "ppm")},
            "range_law": {"air": "all", "ln_strength": _entry(t[3], u[3], "ln(ppm)"), **law, "gamma": _entry(0.1, 0.01, "1")},
            "arm": arm,
            "type_a": [{"rung": 1, "u_a": _entry(1.0, 0.7, "ppm", 0.0)}],
            "type_b": {"rms": _entry(0.01, 0.002, "m", 7.0)},
            "filter": {"assembly": "gum", "P0_prior_parameters": self.cov.tolist()},
        }


@pytest.fixture
def specimen():
    """specimen(seed): a specimen whose calibrations can be drawn."""
    return Specimen


@pytest.fixture
def entries():
    """entries(document, name) as if read from a file; a document is not changed by it."""

    def read(document, name="monday", **sections) -> CalibrationEntries:
        changed = copy.deepcopy(document)
        for path, value in sections.items():
            node, *keys = changed, *path.split("__")
            for key in keys[:-1]:
                node = node[key]
            node[keys[-1]] = value
        return calibration_entries(yaml.safe_dump(changed), name)

    return read
