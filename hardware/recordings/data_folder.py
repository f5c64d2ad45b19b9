"""Data folder: reads a recording's bytes from below the folder in the environment variable OIO_DATA."""

import gzip
import os
import zlib
from pathlib import Path

from oio.core.errors import BadInput


def read_recording(file: str, origin: str) -> bytes:
    """Return the bytes of `file`, a path below OIO_DATA (default `data/`), unpacked if it ends in .gz.

    Raises BadInput if the file is missing (with its download address, `origin`), unreadable or damaged.
    """
    path = Path(os.environ.get("OIO_DATA", "data")) / file
    if not path.is_file():
        raise BadInput(_missing(path, origin))
    try:
        data = path.read_bytes()
        return gzip.decompress(data) if path.suffix == ".gz" else data
    except (OSError, EOFError, zlib.error) as error:
        raise BadInput(f"{path} cannot be read ({error}). Get it again from {origin}.") from None


def _missing(path: Path, origin: str) -> str:
    root = os.environ.get("OIO_DATA")
    folder = f"OIO_DATA is {root}" if root is not None else f"OIO_DATA is not set, so data/ in {Path.cwd()} was taken"
    return (
        f"the recording was looked for at {path}, but there is no such file; {folder}. "
        f"Get it from {origin}, and type OIO_DATA=/folder/that/holds/{path.parent.name} python -m oio.run backend=recording ..."
    )
