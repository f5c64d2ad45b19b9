"""Olfactory inertial odometry: calibrate a gas sensor on a robot arm, and find a smell to the centimetre.

`import oio` takes milliseconds: a name is loaded when it is first used. Their types stand in `__init__.pyi`.
"""

import importlib

__version__ = "0.1.0"
_HOMES = {
    "BadInput": "oio.core.errors",
    "Calibration": "oio.api.calibration",
    "JointPath": "oio.api.samples",
    "LeftOut": "oio.api.left_out",
    "Location": "oio.api.location",
    "LogFile": "oio.api.log_file",
    "NosePath": "oio.api.samples",
    "NotObservable": "oio.core.errors",
    "Odometry": "oio.api.odometry",
    "Readings": "oio.api.samples",
    "Run": "oio.api.logged",
    "Setup": "oio.api.setup",
    "calibrate": "oio.api.calibrate",
    "load_calibration": "oio.api.calibration_file",
    "load_run": "oio.api.logged",
    "locate": "oio.api.location",
    "read_log": "oio.api.log_file",
    "simulate": "oio.api.simulation",
    "write_calibration": "oio.api.calibration_file",
}
__all__ = ["__version__", *_HOMES]  # pyright: ignore[reportUnsupportedDunderAll]


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"module 'oio' has no attribute '{name}'; it has {', '.join(_HOMES)}")
    found = globals()[name] = getattr(importlib.import_module(_HOMES[name]), name)
    return found


def __dir__() -> list[str]:
    return sorted(__all__)
