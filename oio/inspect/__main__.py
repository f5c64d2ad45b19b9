"""`python -m oio.inspect my.csv`: what is in a table, counted: encoding, delimiter, header, clocks, columns; then the YAML to play it."""

import sys
from pathlib import Path

from oio.core import startup
from oio.core.standard_output import ended

startup.handle_signals(__name__)

from oio.core.arguments import CommandParser
from oio.core.errors import BadInput
from oio.inspect.display import show
from oio.inspect.survey import survey
from oio.inspect.yaml_text import yaml_text
from oio.results.yaml_fields import plain_yaml
from oio.tabular.file import file_bytes
from oio.tabular.mapping import open_mapping

CODES = "exit code: 0 it was read (whatever is not certain is named), 2 no table, or bad input"


def main(arguments: list[str] | None = None) -> int:
    """Survey a file, print what was found and the YAML; returns the exit code."""
    given = _parser().parse_args(arguments)
    try:
        if not given.file.is_file():
            raise BadInput(f"{given.file} is no file. Type python -m oio.inspect my.csv (or .txt, .csv.gz, .parquet, .mcap).")
        known = open_mapping(**dict(_key(word) for word in given.known))
        found = survey(file_bytes(given.file, known.first_column), known, given.file.name)
        text = yaml_text(found, given.file)
        if given.out:
            _write(given.out, text)
    except BadInput as error:
        sys.stderr.write(f"oio.inspect: {error}\n")
        return error.exit_code
    show(found)
    sys.stdout.write(f"\n{text}" if not given.out else f"\n{given.out} written.\n")
    return 0


def _key(word: str) -> tuple[str, object]:
    key, mark, value = word.removeprefix("recording.").partition("=")
    if not mark:
        raise BadInput(f"'{word}' is no KEY=VALUE. Type e.g. python -m oio.inspect my.csv time_unit=ms.")
    return key, plain_yaml(value, word, "time_unit=ms")


def _write(path: Path, text: str) -> None:
    if path.exists():
        raise BadInput(f"{path} exists, and is not overwritten. Give another name to --out.")
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        path.unlink(missing_ok=True)  # its beginning, on a disk that is full
        raise BadInput(f"{path} cannot be written ({error.strerror}).") from None


def _parser() -> CommandParser:
    parser = CommandParser(example="my.csv", prog="python -m oio.inspect", description=__doc__, epilog=CODES)
    parser.add_argument("file", type=Path, metavar="FILE", help="a table as text, plain or .gz; .parquet; or the .mcap log of any program")
    parser.add_argument(
        "known", nargs="*", metavar="KEY=VALUE", help="what you know of it: keys of conf/recording/csv.yaml, e.g. time_unit=ms"
    )
    parser.add_argument("--out", type=Path, metavar="FILE.yaml", help="write the YAML there, not below the survey")
    return parser


if __name__ == "__main__":
    sys.exit(ended(main))
