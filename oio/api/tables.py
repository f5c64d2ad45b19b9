"""Tables for notebooks: pandas where it is installed, structured arrays elsewhere."""

import importlib
from typing import Any

import numpy as np

from oio.export.tables import Table

Frame = Any  # a pandas DataFrame, or a structured array: both give a column by its name


def as_frame(table: Table) -> Frame:
    """Return columns of one length as a DataFrame where pandas is installed, else as a structured array (k,)."""
    try:
        pandas = importlib.import_module("pandas")
    except ModuleNotFoundError:
        made = np.empty(len(next(iter(table.values()), ())), dtype=[(name, column.dtype) for name, column in table.items()])
        for name, column in table.items():
            made[name] = column
        return made
    return pandas.DataFrame(dict(table))
