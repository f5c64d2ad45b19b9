"""The project's folders: `ROOT` holds the packages, `CONF` the configuration (beside them in a source tree, inside `oio` in a wheel)."""

from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
CONF = next((path for path in (ROOT / "conf", ROOT / "oio" / "conf") if path.is_dir()), ROOT / "conf")
