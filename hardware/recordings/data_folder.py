"""Data folder: reads a recording's bytes, as it is named or from below the folder in the environment variable OIO_DATA."""

import os
from pathlib import Path

from oio.core.errors import BadInput
from oio.tabular.file import file_bytes


def read_recording(file: str, origin: str, rows_of: str | None = None) -> bytes:
    """Return the bytes of `file`, a path below OIO_DATA (default `data/`), or else one as it is; unpacked as its ending says;
    `rows_of`: see `oio.tabular.file`.

    Raises BadInput if the file is missing (with its download address, `origin`), unreadable or damaged.
    """
    path = Path(os.environ.get("OIO_DATA", "data")) / file
    found = next((one for one in (path, Path(file)) if one.is_file()), None)
    if found is None:
        raise BadInput(_missing(path, origin))
    try:
        return file_bytes(found, rows_of)
    except BadInput as error:
        raise BadInput(f"{error} Get it again from {origin}.") from None


def _missing(path: Path, origin: str) -> str:
    root = os.environ.get("OIO_DATA")
    folder = f"OIO_DATA is {root}" if root is not None else f"OIO_DATA is not set, so data/ in {Path.cwd()} was taken"
    return (
        f"the recording was looked for at {path}, but there is no such file; {folder}. "
        f"Get it from {origin}, and type OIO_DATA=/folder/that/holds/{path.parent.name} python -m oio.run backend=recording ..."
    )
