"""Plug-ins: configuration from a folder (--config-dir) and from packages of other distributions (entry point group `oio.conf`)."""

from importlib import metadata
from pathlib import Path

from hydra._internal.utils import get_args_parser


def plugin_packages() -> list[str]:
    """Configuration packages that other distributions register in the entry point group `oio.conf`, as Hydra names them."""
    return [f"pkg://{point.value}" for point in metadata.entry_points(group="oio.conf")]


def config_folders(arguments: list[str]) -> list[Path]:
    """The user's own configuration folder (--config-dir), if one is given."""
    folder = get_args_parser().parse_known_args(arguments)[0].config_dir
    return [Path(folder)] if folder else []


def search_path(places: list[str]) -> list[str]:
    """The override that puts these places on Hydra's search path, if there are any."""
    return [f"hydra.searchpath=[{','.join(places)}]"] if places else []
