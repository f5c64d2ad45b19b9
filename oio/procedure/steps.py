"""The steps of a protocol: something to do, something to answer, a time to wait. Each stands before or after a stage."""

import re
from typing import Annotated, Any

from oio.core.errors import BadInput
from oio.core.settings import Within, settings
from oio.procedure.answers import Answer, Done

BEFORE, AFTER = "before", "after"
NAME = re.compile(r"[a-z][a-z0-9_]*")


@settings
class Prompt:
    """Something that a person does, and confirms."""

    name: str
    when: dict[str, str]  # before or after: stage
    text: str
    place_m: Annotated[tuple[float, float, float] | None, Within(-100, 100)]  # where it is to be done, in the arm's base frame

    def check(self) -> None:
        """Refuse a name that no file could have, and a moment that is none."""
        _check(self)

    @property
    def answer(self) -> Done:
        """It is confirmed."""
        return Done()

    @property
    def asked(self) -> str:
        """The text with its place in mm."""
        return self.text if self.place_m is None else f"{self.text}: {in_mm(self.place_m)}"


@settings
class Question:
    """Something that a person answers."""

    name: str
    when: dict[str, str]
    text: str
    answer: Answer

    def check(self) -> None:
        """Refuse a name that no file could have, and a moment that is none."""
        _check(self)

    @property
    def asked(self) -> str:
        """The text."""
        return self.text


@settings
class Wait:
    """A time that the world lets pass [s]; what it senses is logged."""

    name: str
    when: dict[str, str]
    text: str
    for_s: Annotated[float, Within(0.1, 86_400)]

    def check(self) -> None:
        """Refuse a name that no file could have, and a moment that is none."""
        _check(self)

    @property
    def asked(self) -> str:
        """The text with its duration."""
        return f"{self.text}: {duration(self.for_s)}"


Asked = Prompt | Question
Step = Prompt | Question | Wait


def in_mm(place_m: tuple[float, float, float]) -> str:
    """A place in the arm's base frame, as one measures it."""
    return ", ".join(f"{axis} {1e3 * value:.0f} mm" for axis, value in zip("xyz", place_m, strict=True))


def duration(for_s: float) -> str:
    """A duration as one reads it from a clock."""
    minutes, s = divmod(for_s, 60.0)
    return f"{minutes:.0f} min{f' {s:g} s' if s else ''}" if minutes else f"{s:g} s"


def _check(step: Any) -> None:
    key = f"protocol.steps, {type(step).__name__} {step.name!r}"
    if not NAME.fullmatch(step.name):
        raise BadInput(f"{key}: a name is of small letters, digits and _. Give one, e.g. serial_number.")
    if len(step.when) != 1 or next(iter(step.when)) not in (BEFORE, AFTER):
        raise BadInput(f"{key} has when: {step.when}, but {BEFORE} or {AFTER} is needed. Give e.g. when: {{{BEFORE}: warm_up}}.")
