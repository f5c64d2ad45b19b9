"""Hook of the wheel's build: with OIO_COMPILED=FOLDER (see `make wheel`) the wheel brings the compiled code in it, and says for what."""

import os
import sys
import sysconfig
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class CompiledCode(BuildHookInterface):  # type: ignore[type-arg]
    """Adds compiled code to a wheel."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Add the folder, and the tag of this Python and system."""
        folder = os.environ.get("OIO_COMPILED")
        if not folder or version == "editable":
            return
        build_data["force_include"][os.path.abspath(folder)] = "oio/_compiled"
        build_data["pure_python"] = False
        python = f"cp{sys.version_info.major}{sys.version_info.minor}"
        build_data["tag"] = f"{python}-{python}-{sysconfig.get_platform().replace('-', '_').replace('.', '_')}"
