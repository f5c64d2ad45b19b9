"""Earlier attempts of a job are kept: their folders get another name before the job runs again."""

from pathlib import Path


def set_aside(path: Path) -> Path | None:
    """Rename a job's folder to NAME.attempt1, NAME.attempt2 and so on; returns the new path, or None if there was nothing in it."""
    if not path.is_dir():
        return None
    if not any(path.iterdir()):
        path.rmdir()
        return None
    number = 1
    while (kept := path.with_name(f"{path.name}.attempt{number}")).exists():
        number += 1
    return path.rename(kept)
