"""Who performs the protocol of a run: a file of answers, or the person at the terminal. Decided before the world opens."""

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext

from oio.core.errors import BadInput
from oio.procedure import terminal
from oio.procedure.performance import Performance
from oio.procedure.procedure import Procedure
from oio.procedure.written_answers import WrittenAnswers


def performance(
    procedure: Procedure | None, unattended: bool, quiet: Callable[[], AbstractContextManager[None]] = nullcontext
) -> Performance | None:
    """Return the performance of a protocol, None without one. `quiet` is a context in which the terminal is not drawn to.

    Raises BadInput for answers that are missing or wrong, and where nobody can be asked: a job of a sweep, or no terminal.
    """
    if procedure is None:
        return None
    if procedure.answers is not None:
        return Performance(procedure, WrittenAnswers.read(procedure))
    if procedure.asked and (unattended or not terminal.is_there()):
        asked = ", ".join(step.name for step in procedure.asked)
        where = "a job of a sweep asks nobody" if unattended else "there is no terminal to ask at"
        raise BadInput(
            f"protocol={procedure.name} asks for {asked}, but {where}. Write the answers to a file, "
            f"NAME: ANSWER, and type protocol.answers=FILE; python -m oio.protocol {procedure.name} prints what is asked."
        )
    return Performance(procedure, terminal.Terminal(quiet))
