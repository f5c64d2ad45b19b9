"""Answers that a step can take: what a person types is parsed, what a file holds is checked. Both raise BadInput with what is allowed."""

import math
from typing import Annotated

from oio.core.errors import BadInput
from oio.core.settings import Within, settings

Value = str | float | bool
DONE = "done"
YES, NO = ("yes", "y"), ("no", "n")


@settings
class Done:
    """No answer but that it was done."""

    @property
    def allowed(self) -> str:
        """What is allowed, in words."""
        return f"Enter, or {DONE} in a file"

    def parsed(self, typed: str) -> Value:
        """Whatever is typed, Enter says that it was done."""
        return DONE

    def checked(self, value: object) -> Value:
        """In a file, the word must stand: nobody is there to press Enter."""
        return _one_of(value, (DONE,), self.allowed)


@settings
class Text:
    """A line of text."""

    @property
    def allowed(self) -> str:
        """What is allowed, in words."""
        return "a line of text"

    def parsed(self, typed: str) -> Value:
        """A line that is not empty."""
        return self.checked(typed)

    def checked(self, value: object) -> Value:
        """In a file, a number wants quotes: YAML makes another of 0012."""
        if not isinstance(value, str) or not value.strip() or not value.strip().isprintable():
            raise BadInput(f"{value!r} was given, but {self.allowed} is allowed, in quotes in a file.")
        return value.strip()


@settings
class Number:
    """A number in a unit, from low to high."""

    unit: str
    low: Annotated[float, Within(-1e9, 1e9)]
    high: Annotated[float, Within(-1e9, 1e9)]

    @property
    def allowed(self) -> str:
        """What is allowed, in words."""
        return f"a number from {self.low:g} to {self.high:g} {self.unit}"

    def parsed(self, typed: str) -> Value:
        """A number as Python reads it."""
        try:
            return self.checked(float(typed))
        except ValueError:
            raise BadInput(f"{typed!r} was given, but {self.allowed} is allowed.") from None

    def checked(self, value: object) -> Value:
        """An int or a float in the range."""
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        if not is_number or not math.isfinite(number := float(value)) or not self.low <= number <= self.high:  # type: ignore[arg-type]
            raise BadInput(f"{value!r} was given, but {self.allowed} is allowed.")
        return number


@settings
class YesNo:
    """Yes or no."""

    @property
    def allowed(self) -> str:
        """What is allowed, in words."""
        return "yes or no"

    def parsed(self, typed: str) -> Value:
        """The word or its first letter."""
        word = _one_of(typed.lower(), (*YES, *NO), self.allowed)
        return word in YES

    def checked(self, value: object) -> Value:
        """In a file, YAML makes a bool of the word."""
        return value if isinstance(value, bool) else self.parsed(str(value))


@settings
class Choice:
    """One of some words."""

    options: tuple[str, ...]

    @property
    def allowed(self) -> str:
        """What is allowed, in words."""
        return f"one of {', '.join(self.options)}"

    def check(self) -> None:
        """Refuse a choice of less than two."""
        if len(set(self.options)) < 2:
            raise BadInput(f"Choice.options is {list(self.options)}, but a choice has two options at least.")

    def parsed(self, typed: str) -> Value:
        """One of the options."""
        return self.checked(typed)

    def checked(self, value: object) -> Value:
        """One of the options."""
        return _one_of(value, self.options, self.allowed)


Answer = Text | Number | YesNo | Choice


def _one_of(value: object, options: tuple[str, ...], allowed: str) -> str:
    if not isinstance(value, str) or value not in options:
        raise BadInput(f"{value!r} was given, but {allowed} is allowed.")
    return value
