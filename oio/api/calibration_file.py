"""A calibration read from and written to a calibration.yaml; the file is data, and nothing in it is built or run."""

import re
from pathlib import Path
from typing import Any

from oio.api.array_input import expected
from oio.api.calibration import EXAMPLE, Calibration
from oio.api.setup import Setup, in_one_paragraph
from oio.core.errors import BadInput
from oio.results.kept_calibration import kept_of
from oio.results.yaml_fields import Fields, plain_yaml

NAMED = re.compile(r"[A-Za-z_]\w*")


def load_calibration(path: str | Path, setup: Setup | None = None) -> Calibration:
    """Read a calibration.yaml; nothing in it is built or run. Raises BadInput for a file that is none, or does not fit `setup`.

    `setup`: sensor and arm with which it is used; None: those that the file names, with the numbers of conf/ as they are.
    """
    try:
        text = Path(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise BadInput(f"{path} cannot be read: {error}. {EXAMPLE}") from None
    return calibration_of(text, str(path), setup)


def write_calibration(calibration: Calibration, path: str | Path) -> None:
    """Write a calibration to a new file, which `load_calibration` and `python -m oio.run calibration=FILE` read to the last bit.

    Raises BadInput if the file exists, or cannot be written.
    """
    expected("calibration", calibration, Calibration, "what oio.calibrate returned")
    try:
        with Path(path).open("x", encoding="utf-8") as file:
            file.write(calibration.text)
    except OSError as error:
        raise BadInput(f"{path} cannot be written: {error.strerror}. Give the path of a file that does not exist.") from None


def calibration_of(text: str, name: str, setup: Setup | None) -> Calibration:
    """Return the calibration of a file's text; `name` is that of the file, for errors."""
    setup = setup or _setup_of(text, name)
    with in_one_paragraph():
        kept = kept_of(text, name, setup.robot, setup.part("range_law"))
    elements = setup.part("nominal").elements
    if kept.holds_for["sensor"] != setup.nose.name or len(kept.baselines) != elements:
        made = f"{name} holds for sensor={kept.holds_for['sensor']} with {len(kept.baselines)} elements"
        raise BadInput(f"{made}, but the setup has sensor={setup.nose.name} with {elements}. Give a setup of that sensor.")
    return Calibration(text, setup, kept)


def _setup_of(text: str, name: str) -> Setup:
    """Sensor and arm that a file names: words, which are looked up in conf/."""
    held: Any = Fields(plain_yaml(text, name, EXAMPLE), name).section("holds_for")
    chosen = {key: held.text(key) for key in ("sensor", "arm", "profile")}
    strange = [word for word in chosen.values() if not NAMED.fullmatch(word)]
    if strange:
        raise BadInput(f"{name} names '{strange[0]}', which is no choice of conf/. {EXAMPLE}")
    return Setup(chosen["sensor"], len(held.texts("joints")), chosen["arm"], chosen["profile"])
