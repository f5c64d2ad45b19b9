"""Places with choices of one's own: folders (--config-dir, hydra.searchpath), packages of other distributions (entry points `oio.conf`)."""

from collections.abc import Sequence
from importlib import metadata
from pathlib import Path

from hydra._internal.utils import get_args_parser
from hydra.core.override_parser.overrides_parser import OverridesParser

KEY = "hydra.searchpath="
FOLDER = "file://"


def plugin_packages() -> list[str]:
    """Configuration packages that other distributions register in the entry point group `oio.conf`, as Hydra names them."""
    return [f"pkg://{point.value}" for point in metadata.entry_points(group="oio.conf")]


def without_search_path(words: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return the words but those that set hydra.searchpath, and the places that these name; folders as absolute paths."""
    given = [OverridesParser.create().parse_override(word).value() for word in words if word.startswith(KEY)]
    listed = [places if isinstance(places, list) else [places] for places in given]
    return [word for word in words if not word.startswith(KEY)], [absolute(str(place)) for places in listed for place in places]


def config_places(arguments: list[str]) -> tuple[str, ...]:
    """All places that a command line of Hydra names, then the packages of other distributions."""
    folder = get_args_parser().parse_known_args(arguments)[0].config_dir
    own = [absolute(f"{FOLDER}{folder}")] if folder else []
    return (*own, *without_search_path(arguments)[1], *plugin_packages())


def own_places(words: Sequence[str]) -> tuple[list[str], tuple[str, ...]]:
    """Return the words of a command that is none of Hydra's without those of --config-dir, and all places, as `config_places` does."""
    others, own, rest = list[str](), list[str](), iter(words)
    for word in rest:
        key, equals, folder = word.partition("=")
        if key in ("--config-dir", "-cd"):
            own.append(absolute(f"{FOLDER}{folder if equals else next(rest, '')}"))
        else:
            others.append(word)
    return others, (*own, *plugin_packages())


def absolute(place: str) -> str:
    """Return a place with its folder as an absolute path: a worker, or a later command, may be elsewhere."""
    return f"{FOLDER}{Path(place.removeprefix(FOLDER)).resolve()}" if place.startswith(FOLDER) else place


def search_path(places: Sequence[str]) -> list[str]:
    """The override that puts these places on Hydra's search path, if there are any."""
    return [f"{KEY}[{','.join(places)}]"] if places else []
