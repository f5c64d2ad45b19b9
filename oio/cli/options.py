"""Options of `oio.run`, which are Hydra's."""

import difflib
from typing import NoReturn

from hydra._internal.utils import get_args_parser

from oio.core.errors import BadInput


def refuse_unknown_options(arguments: list[str]) -> None:
    """Raise BadInput for words that Hydra's parser of the command line would answer with its usage."""
    parser = get_args_parser()
    known = [option for action in parser._actions for option in action.option_strings]

    def refuse(message: str) -> NoReturn:
        wrong = next((word for word in arguments if word.startswith("-") and word.partition("=")[0] not in known), None)
        near = difflib.get_close_matches(wrong or "", known, 1)
        given = f"{wrong} was given, but oio.run has no such option" if wrong else f"the command line cannot be read: {message}"
        example = f"Type {near[0]}, or" if near else "Type"
        raise BadInput(f"{given}. {example} KEY=VALUE words, e.g. sensor=ec dof=5; --help lists keys and options.")

    parser.error = refuse  # type: ignore[method-assign]
    parser.parse_args(arguments)
