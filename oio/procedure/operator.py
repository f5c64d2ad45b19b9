"""Who answers the steps of a protocol: a person at the terminal, or a file."""

from contextlib import AbstractContextManager
from typing import Protocol

from oio.procedure.answers import Value
from oio.procedure.steps import Asked, Step


class Operator(Protocol):
    """Protocol of who answers."""

    def attends(self, step: Step, number: int, of: int) -> AbstractContextManager[None]:
        """Show step `number` of `of`; the context lasts until it is over."""
        ...

    def answer(self, step: Asked) -> Value | None:
        """Return the answer, None if there is none yet; waits a moment for it. Raises OioError if nobody is there any more."""
        ...

    def left(self, step: Step, left_s: float) -> None:
        """Show how much of a wait is left [s]."""
        ...
