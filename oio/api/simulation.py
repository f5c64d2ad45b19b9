"""`simulate`: a whole run in the simulated room, as `python -m oio.run` makes it, returned instead of left on the disk."""

import tempfile
from collections.abc import Mapping
from pathlib import Path

from oio.api.logged import Run, load_run
from oio.api.setup import Setup, in_one_paragraph
from oio.core.errors import BadInput


def simulate(
    sensor: str = "ec", dof: int = 5, seed: int = 0, *, out: str | Path | None = None, overrides: Mapping[str, object] | None = None,
    **choices: object,
) -> Run:  # fmt: skip
    """Run warm-up, calibration and search in simulation; the same numbers as `python -m oio.run sensor=... dof=... seed=...`.

    `choices`: further words of the command line whose keys have no dot (air="draft", stage=["warm_up", "baseline"]); `overrides`: those
    that have, e.g. {"stage.navigate.max_moves": 20}. `out`: a new folder that keeps the run; None: nothing is left on the disk. Takes a
    minute or two. Raises BadInput for wrong words, and what a run raises: NotSettled, NotObservable.
    """
    words: dict[str, object] = {**choices, **(overrides or {})}
    if str(words.get("backend", "mujoco")) != "mujoco":
        raise BadInput(f"backend={words['backend']} was given, but only mujoco is simulated. Type python -m oio.run for another backend.")
    if words.get("logging", "full") != "full":
        raise BadInput(f"logging={words['logging']} was given, but what is returned is read from the log. Leave logging out.")
    if words.get("trials", 1) != 1:
        raise BadInput(f"trials={words['trials']} was given, but one run is returned. Leave it out, and call again with another seed.")
    arm, profile = str(words.pop("arm", "so101")), str(words.pop("profile", "paper"))
    with in_one_paragraph():
        setup = Setup(sensor, dof, arm, profile, words)
        if out is not None:
            return _executed(setup, seed, Path(out))
        with tempfile.TemporaryDirectory(prefix="oio_") as folder:
            return _executed(setup, seed, Path(folder) / "run")


def _executed(setup: Setup, seed: int, out: Path) -> Run:
    from oio.cli.build import build
    from oio.cli.compose import compose
    from oio.cli.execute import execute

    words = [*setup.words, f"seed={seed}"]
    composed = compose(words, ())
    execute(build(composed.cfg, composed.choices, words), out, quiet=True)
    plain = {key: value for key, value in setup.overrides.items() if key.partition(".")[0] not in ("stage", "calibration")}
    return load_run(out, Setup(setup.sensor, setup.dof, setup.arm, setup.profile, plain))
