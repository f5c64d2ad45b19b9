"""Output folder of a benchmark, never shared with another."""

import datetime
from pathlib import Path

from oio.core.errors import BadInput


def claim_folder(out: str, command: str, files: tuple[str, ...]) -> Path:
    """Return the folder `out`, or a new one below outputs/ if it is `null`; raises BadInput if it already holds results."""
    now = datetime.datetime.now().astimezone()  # folder name, as Hydra makes them; no result depends on it
    folder = Path(out) if out != "null" else Path("outputs") / f"{now:%Y-%m-%d}" / f"{now:%H-%M-%S-%f}_{command}"
    taken = next((folder / name for name in files if (folder / name).exists()), None)
    if taken is not None:
        raise BadInput(f"{taken} is there already, and results are never overwritten. Give another folder, e.g. out={folder}_2.")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        given = f"out={out} was given, but no folder can be made there ({error.strerror})"
        raise BadInput(f"{given}. Type e.g. out=outputs/{command}.") from None
    return folder
