"""Answers in a file: YAML that a person wrote, or the log of a run with the same protocol. They are data, all checked at once."""

import json
from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any

import yaml

from oio.core.errors import BadInput
from oio.log import read_events
from oio.procedure.answers import Value
from oio.procedure.procedure import Procedure
from oio.procedure.steps import Asked, Step

KIND = "protocol"  # of the events in the log
LOG = ".mcap"


class WrittenAnswers:
    """Operator that answers from what was read before the run began."""

    def __init__(self, values: Mapping[str, Value]) -> None:
        self._values = values

    @classmethod
    def read(cls, procedure: Procedure) -> "WrittenAnswers":
        """Read and check all answers. Raises BadInput for a file that cannot be read, and for missing, unknown and wrong answers."""
        assert procedure.answers is not None
        path = Path(procedure.answers).expanduser()
        return cls(checked(procedure, _from_log(path) if path.suffix == LOG else _from_yaml(path)))

    def attends(self, step: Step, number: int, of: int) -> AbstractContextManager[None]:
        """See `Operator`."""
        return nullcontext()

    def answer(self, step: Asked) -> Value:
        """See `Operator`."""
        return self._values[step.name]

    def left(self, step: Step, left_s: float) -> None:
        """Nobody looks."""


def checked(procedure: Procedure, given: Mapping[str, Any]) -> dict[str, Value]:
    """Return the answers by step. Raises BadInput, naming all that is missing or unknown, or the first that is wrong."""
    file, names = procedure.answers, [step.name for step in procedure.asked]
    missing, unknown = [name for name in names if name not in given], [name for name in given if name not in names]
    if missing or unknown:
        what = "; ".join(
            f"{word} {', '.join(map(str, found))}" for word, found in (("without", missing), ("with unknown", unknown)) if found
        )
        raise BadInput(f"protocol.answers={file} was given, {what}. protocol={procedure.name} asks for {', '.join(names) or 'nothing'}.")
    return {step.name: _checked(step, given[step.name], f"protocol.answers={file}, {step.name}") for step in procedure.asked}


def _checked(step: Asked, value: object, where: str) -> Value:
    try:
        return step.answer.checked(value)
    except BadInput as error:
        raise BadInput(f"{where}: {error}") from None


def _from_yaml(path: Path) -> Mapping[str, Any]:
    try:
        given = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise BadInput(
            f"protocol.answers={path} cannot be read ({' '.join(str(error).split())}). Give a YAML file of NAME: ANSWER."
        ) from None
    if not isinstance(given, Mapping):
        raise BadInput(f"protocol.answers={path} holds no NAME: ANSWER lines. Write one for each step, e.g. operator: Ada.")
    return given


def _from_log(path: Path) -> Mapping[str, Any]:
    return {str(event["step"]): event["answer"] for event in protocol_events(path) if "answer" in event}


def protocol_events(log: Path) -> Iterator[dict[str, Any]]:
    """Yield what a log has of a protocol: `t_ns`, `step`, `kind`, `state` (`begin`, `done`), perhaps `text`, `answer`, `unit`."""
    for event in read_events(log):
        if event.kind == KIND:
            yield {"t_ns": event.t_ns, **json.loads(event.text)}
