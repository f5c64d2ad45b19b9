"""A protocol: its steps in order, each before or after a stage."""

from collections.abc import Collection

from oio.core.errors import BadInput
from oio.core.settings import settings
from oio.procedure.steps import Asked, Prompt, Question, Step, Wait


@settings
class Procedure:
    """A written procedure; frozen. `answers` is the file that answers in place of a person."""

    name: str
    title: str
    answers: str | None  # a YAML file NAME: ANSWER, or the log of a run with this protocol; null: a person at the terminal
    steps: tuple[Prompt | Question | Wait, ...]

    def check(self) -> None:
        """Refuse two steps of one name."""
        names = [step.name for step in self.steps]
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice is not None:
            raise BadInput(f"protocol.steps has two steps of the name {twice}, but an answer belongs to one. Give another name.")

    def at(self, moment: str, stage: str) -> list[Step]:
        """Return the steps `before` or `after` a stage, in order."""
        return [step for step in self.steps if step.when.get(moment) == stage]

    @property
    def asked(self) -> list[Asked]:
        """The steps that are answered."""
        return [step for step in self.steps if not isinstance(step, Wait)]

    def check_stages(self, stages: Collection[str]) -> None:
        """Raise BadInput for a step at a stage that is not run."""
        for step in self.steps:
            (moment, stage), *_ = step.when.items()
            if stage not in stages:
                run = f"stage=[{','.join(stages)}] is run. Add the stage, or take another protocol."
                raise BadInput(f"protocol={self.name} has the step {step.name} {moment} the stage {stage}, but {run}")
