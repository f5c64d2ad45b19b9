"""Rows of several devices in one table, told apart by a column that names the device: sensor_id, channel, entity_id ..."""

import re
from collections.abc import Sequence

from oio.core.errors import BadInput
from oio.tabular.layout import Layout, is_number
from oio.tabular.mapping import typed
from oio.tabular.rows import sample
from oio.tabular.text import Text

NAMES = re.compile(
    r"(sensor|device|node|channel|board|unit|entity|station|probe|mote)[ _]?(id|name|nr|no|number|serial)|"
    r"sensor|node|channel|topic|tag|mac|serial|_field|_measurement",
    re.IGNORECASE,
)
MOST = 50  # devices of one table; more values than that are readings
SHOWN = 5


def only_of(where: str | None) -> tuple[str, str] | None:
    """Column and value of `NAME=VALUE`; None without one."""
    if where is None:
        return None
    column, mark, value = where.rpartition("=")
    if not mark or not column.strip():
        raise BadInput(f"recording.where is {where!r}, but it is a column and its value. Type e.g. 'recording.where=\"sensor_id=1\"'.")
    return column.strip(), value.strip()


def refuse_devices(source: Text, layout: Layout, used: Sequence[str]) -> None:
    """Raise BadInput if a column, none of those that are used, tells rows of several devices apart."""
    for column in (name for name in layout.names if name not in used and NAMES.fullmatch(name.strip())):
        cells = [cell.strip(' "') for cell in sample(source, layout, column)]
        devices = list(dict.fromkeys(cell for cell in cells if cell))
        readings = column.strip().lower() == "sensor" and all(map(is_number, devices))
        if 2 <= len(devices) <= MOST and 3 * len(devices) <= len(cells) and not readings:
            listed = ", ".join(devices[:SHOWN]) + (", ..." if len(devices) > SHOWN else "")
            raise BadInput(
                f"{source.name} has rows of {len(devices)} devices, by its column '{column}' ({listed}), and one sensor is read at a time. "
                f"Type {typed('where', f'{column}={devices[0]}')}, or another of them."
            )
