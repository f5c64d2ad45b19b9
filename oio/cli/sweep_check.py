"""Check of a sweep before its first job: a wrong value anywhere is refused while nothing has run."""

from hydra._internal.utils import get_args_parser
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import IntervalSweep, Override

from oio.cli.attendant import performance
from oio.cli.build import build
from oio.cli.compose import compose
from oio.cli.plugins import config_places
from oio.core.errors import BadInput


def refuse_bad_choices(arguments: list[str]) -> None:
    """Before a sweep: compose and build every value of every swept key but the seeds, with the first values of the others."""
    words = get_args_parser().parse_args(arguments).overrides
    parsed = OverridesParser.create().parse_overrides(words)
    swept = [o for o in parsed if o.is_sweep_override() and not o.is_hydra_override()]
    if any(o.key_or_group.split(".")[0] == "view" and o.value() != "none" for o in parsed):
        raise BadInput("a sweep was asked for with a view, but its jobs run at once and nobody could follow. Leave view= out.")
    values = {o.key_or_group: _values(o, arguments) for o in swept}
    plain = [w for w, o in zip(words, parsed, strict=True) if not o.is_sweep_override() and not w.startswith("hydra")]
    places = config_places(arguments)
    for chosen in _distinct({key: options[0] for key, options in values.items()}, values):
        composed = compose([*plain, *(f"{k}={v}" for k, v in chosen.items())], places)
        performance(build(composed.cfg, composed.choices, []).procedure, unattended=True)


def _values(swept: Override, arguments: list[str]) -> list[str]:
    """The values of a swept key; of an interval its two ends."""
    if swept.is_discrete_sweep():
        return list(swept.sweep_string_iterator())
    if not any(word.startswith("hydra/sweeper=") for word in arguments):
        given = f"{swept.input_line} was given, but a sweep of all combinations takes single values"
        raise BadInput(f"{given}. Type e.g. {swept.key_or_group}=1,2,3, or hydra/sweeper=optuna to search the interval for the best.")
    interval = swept.value()
    assert isinstance(interval, IntervalSweep)
    return [str(interval.start), str(interval.end)]


def _distinct(first: dict[str, str], values: dict[str, list[str]]) -> list[dict[str, str]]:
    """The combinations to try: the first values, and each other value beside the first ones. All seeds that are whole numbers are alike."""
    tried = [first]
    for key, options in values.items():
        seeds = key.split(".")[0] in ("seed", "seeds")
        tried += [{**first, key: value} for value in options[1:] if not (seeds and value.isdigit())]
    return tried
