"""The page of a protocol for the lab book: its content, which the writers of Markdown and HTML lay out."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from oio.procedure.procedure import Procedure
from oio.procedure.steps import AFTER, BEFORE, Prompt, Step, Wait

BLANK = "_" * 20
Rows = tuple[tuple[str, str], ...]


@dataclass(frozen=True, slots=True)
class Item:
    """One numbered line: what it is, what is done, a blank to fill in (empty: none), and the keys of a stage."""

    title: str
    text: str
    blank: str
    keys: Rows = ()


@dataclass(frozen=True, slots=True)
class StageAbout:
    """What the page says of a stage: a sentence, and its keys with their values."""

    sentence: str
    keys: Rows


@dataclass(frozen=True, slots=True)
class Page:
    """The page: title, choices of the run, places in mm, the numbered items, and what the run will record."""

    title: str
    choices: Rows
    places: Rows
    items: tuple[Item, ...]
    records: Rows


def page(procedure: Procedure, stages: Mapping[str, StageAbout], choices: Rows, places: Rows, records: Rows) -> Page:
    """Lay steps and stages in the order in which a run performs them."""
    items = [item for name, about in stages.items() for item in _around(procedure, name, about)]
    return Page(procedure.title, choices, places, tuple(items), records)


def _around(procedure: Procedure, name: str, about: StageAbout) -> Sequence[Item]:
    stage = Item(f"stage {name}", about.sentence, "", about.keys)
    return [*map(_item, procedure.at(BEFORE, name)), stage, *map(_item, procedure.at(AFTER, name))]


def _item(step: Step) -> Item:
    if isinstance(step, Wait):
        return Item(step.name, step.asked, "from ________ to ________")
    if isinstance(step, Prompt):
        return Item(step.name, step.asked, "done [ ]")
    return Item(step.name, step.asked, f"{BLANK} ({step.answer.allowed})")
