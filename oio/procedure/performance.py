"""A protocol performed in one run: its steps around the stages, each in the log when it begins and when it is done."""

import json

from oio.core.records import Event, nanoseconds, seconds
from oio.log import RunLog
from oio.procedure.answers import Number, Value
from oio.procedure.operator import Operator
from oio.procedure.procedure import Procedure
from oio.procedure.steps import Asked, Question, Step, Wait
from oio.procedure.written_answers import KIND
from oio.runtime.guarded_world import GuardedWorld

SERIAL = "sensor_serial"  # name of the step whose answer is the sensor's serial number, which its calibration then holds for


class Performance:
    """The steps of a protocol as `Between` of a run; `answers` are those given so far, by step."""

    def __init__(self, procedure: Procedure, operator: Operator) -> None:
        self._procedure, self._operator = procedure, operator
        self.answers: dict[str, Value] = {}

    @property
    def sensor_serial(self) -> str | None:
        """The sensor's serial number, if it was asked for and told."""
        return str(self.answers[SERIAL]).strip() or None if SERIAL in self.answers else None

    @property
    def document(self) -> dict[str, object]:
        """What summary.json says of it."""
        return {"name": self._procedure.name, "answers": dict(self.answers)}

    def __call__(self, moment: str, stage: str, world: GuardedWorld, log: RunLog) -> None:
        """Perform the steps before or after a stage."""
        for step in self._procedure.at(moment, stage):
            _note(step, world, log, state="begin", text=step.asked)
            with self._operator.attends(step, 1 + self._procedure.steps.index(step), len(self._procedure.steps)):
                answer = self._wait(step, world) if isinstance(step, Wait) else self._ask(step, world)
            _note(step, world, log, state="done", **answer)

    def _wait(self, step: Wait, world: GuardedWorld) -> dict[str, Value]:
        end_ns = world.t_ns + nanoseconds(step.for_s)
        for sample in world.samples(step.for_s):
            self._operator.left(step, max(seconds(end_ns - sample.t_ns), 0.0))
        return {}

    def _ask(self, step: Asked, world: GuardedWorld) -> dict[str, Value]:
        given: list[Value] = []

        def is_answered() -> bool:
            answer = self._operator.answer(step)
            given.extend([] if answer is None else [answer])
            return bool(given)

        world.attend(is_answered)
        self.answers[step.name] = given[0]
        if step.name == SERIAL:
            world.sensor_serial = str(given[0]).strip() or None
        unit = {"unit": step.answer.unit} if isinstance(step, Question) and isinstance(step.answer, Number) else {}
        return {"answer": given[0], **unit}


def _note(step: Step, world: GuardedWorld, log: RunLog, **told: Value) -> None:
    text = json.dumps({"step": step.name, "kind": type(step).__name__.lower(), **told}, ensure_ascii=False)
    log.write(Event(world.t_ns, KIND, text))
