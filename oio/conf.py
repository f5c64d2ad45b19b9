"""Where the configuration lies: beside the packages in a source tree, within `oio` in a wheel."""

from pathlib import Path

from oio.arm import ROOT

CONF = next((path for path in (ROOT / "conf", Path(__file__).parent / "conf") if path.is_dir()), ROOT / "conf")
