"""The mapping of a table as YAML to paste: conf/recording/NAME.yaml of a folder for --config-dir."""

import json
import re
from pathlib import Path

from oio.inspect.survey import Survey

KEYS = (
    "encoding",
    "delimiter",
    "decimal",
    "time",
    "time_unit",
    "period_s",
    "columns",
    "unit",
    "per_ppm",
    "no_value",
    "climate_columns",
    "where",
    "session",
)


def yaml_text(found: Survey, file: Path) -> str:
    """Return the YAML; what is not certain stands there as null with the reason, and is refused by a run until it is typed."""
    name = re.sub(r"\W+", "_", file.stem) or "log"
    lines = [
        f"# From python -m oio.inspect {json.dumps(file.name)}.",
        f"# Save it as FOLDER/recording/{name}.yaml and type",
        "# python -m oio.run --config-dir FOLDER backend=recording",
        f"#   recording={name} 'stage=[warm_up,baseline]'",
        "defaults: [csv, _self_]",
        f"name: {_quoted(name)}",
        f"file: {_quoted(str(file))}",
    ]
    for key in KEYS:
        value = getattr(found.mapping, key)
        if key in found.open_keys:
            lines.append(f"{key}: null  # not certain: the survey says why, and what it can be")
        elif value is not None:
            lines.append(f"{key}: {_quoted(value)}")
    return "\n".join(lines) + "\n"


def _quoted(value: object) -> str:
    """A value as YAML. What stands in a file is a name, and no interpolation of Hydra's, whatever it looks like."""
    return json.dumps(value, ensure_ascii=False).replace("${", "\\\\${")
