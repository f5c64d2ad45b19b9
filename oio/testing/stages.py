"""Conformance tests of stages."""

import inspect

from oio.core.errors import BadInput
from oio.runtime.runner import Stage, result_type
from oio.testing.assertions import require, require_frozen


def check_stage(stage: Stage) -> None:
    """Check a stage: frozen; `needs` is a tuple of classes; `run` takes a context and is annotated with its result class."""
    require_frozen(stage)
    name, needs = type(stage).__name__, getattr(type(stage), "needs", None)
    require(isinstance(needs, tuple), f"{name}.needs is a tuple of the results it reads, () for none, and a ClassVar.")
    require(all(isinstance(need, type) for need in stage.needs), f"{name}.needs holds classes, not {stage.needs}.")
    require(list(inspect.signature(stage.run).parameters) == ["context"], f"{name}.run takes a context and nothing else.")
    try:
        kind = result_type(stage)
    except BadInput as error:
        raise AssertionError(str(error)) from None
    require(kind is not type(None), f"{name}.run gives something: a class of its own, so that other stages can need it.")
    require(kind not in stage.needs, f"{name} does not need {kind.__name__}, which it gives itself.")
