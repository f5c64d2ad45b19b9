"""A person at the terminal: shown on standard error, answered on standard input."""

import select
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager

from oio.core.errors import BadInput, OioError
from oio.procedure.answers import Value
from oio.procedure.steps import Asked, Step, Wait, duration

LOOK_S = 0.2  # longest wait for a line before the world is looked at again


class Terminal:
    """Operator that asks a person. `quiet` is a context in which nothing else is drawn in the terminal."""

    def __init__(self, quiet: Callable[[], AbstractContextManager[None]]) -> None:
        self._quiet, self._shown_s = quiet, -1

    @contextmanager
    def attends(self, step: Step, number: int, of: int) -> Iterator[None]:
        """See `Operator`."""
        with self._quiet():
            _say(f"oio: {number}/{of} {step.asked}\n")
            if not isinstance(step, Wait):
                _say(f"     ({step.answer.allowed}) ")
            yield
            if isinstance(step, Wait):
                _say("\r     over.          \n")

    def answer(self, step: Asked) -> Value | None:
        """See `Operator`. A wrong answer is asked for again."""
        if not select.select([sys.stdin], [], [], LOOK_S)[0]:
            return None
        typed = sys.stdin.readline()
        if not typed:
            raise OioError(
                f"nobody is there to answer '{step.name}': standard input has ended. Type protocol.answers=FILE to run unattended."
            )
        try:
            return step.answer.parsed(typed.strip())
        except BadInput as error:
            _say(f"     {error}\n     ({step.answer.allowed}) ")
            return None

    def left(self, step: Step, left_s: float) -> None:
        """See `Operator`: once per second."""
        if int(left_s) != self._shown_s:
            self._shown_s = int(left_s)
            _say(f"\r     {duration(float(self._shown_s))} left   ")


def is_there() -> bool:
    """Whether there is a terminal to ask at."""
    return sys.stdin is not None and sys.stdin.isatty()


def _say(text: str) -> None:
    sys.stderr.write(text)
    sys.stderr.flush()
