"""One criterion of a verdict: a value, the limits within which it passes or warns, and what to do where it does not."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar

from oio.core.errors import BadInput
from oio.core.settings import Within, settings

PASS, WARN, FAIL = WORDS = "PASS", "WARN", "FAIL"  # from good to bad
NOTHING = "no stage that can be judged has run."
RECALIBRATE = "Calibrate again in the air, and with the sensor, of the search: leave calibration= and stage= out."
CALIBRATION, SEARCH = "calibration", "search"  # what a criterion is about
Results = Mapping[type, object]  # of the stages that have run, by their class
Limits = tuple[float | None, float | None]


@dataclass(frozen=True, slots=True)
class Measured:
    """Value of a criterion with its unit, what was found as a clause, and the next action where the value is below or above its limits."""

    value: float
    unit: str
    found: str
    below: str = ""
    above: str = ""


@dataclass(frozen=True, slots=True)
class Judgement:
    """One line of a verdict: PASS, WARN or FAIL; `allowed` are the limits of PASS in words, `action` is empty for PASS."""

    name: str
    about: str  # calibration or search
    word: str
    value: float
    unit: str
    allowed: str
    found: str
    action: str

    @property
    def reason(self) -> str:
        """The line as one sentence or two."""
        return f"{self.name}: {self.found} ({self.allowed}). {self.action}"


@settings
class Criterion(ABC):
    """Base of all criteria. Limits are (low, high) with null for an open end: PASS within `passes`, else WARN within `warns`, else FAIL."""

    about: ClassVar[str] = CALIBRATION
    passes: Annotated[Limits, Within(-1e12, 1e12)]
    warns: Annotated[Limits, Within(-1e12, 1e12)]

    def check(self) -> None:
        """Raise BadInput if `warns` does not hold `passes`."""
        (low, high), (lowest, highest) = self.passes, self.warns
        if (lowest is not None and (low is None or low < lowest)) or (highest is not None and (high is None or high > highest)):
            raise BadInput(
                f"{type(self).__name__}: passes is {list(self.passes)} and warns is {list(self.warns)}, but warns must hold all of passes."
            )

    @abstractmethod
    def measure(self, results: Results) -> Measured | None:
        """Return the value, or None if the stages that it needs did not run."""

    def judge(self, name: str, results: Results) -> Judgement | None:
        """Judge the results under a name; None if there is nothing to judge."""
        measured = self.measure(results)
        if measured is None:
            return None
        word = PASS if _within(measured.value, self.passes) else WARN if _within(measured.value, self.warns) else FAIL
        low = self.passes[0]
        action = "" if word == PASS else measured.below if low is not None and measured.value < low else measured.above
        return Judgement(name, self.about, word, measured.value, measured.unit, self.allowed(measured.unit), measured.found, action)

    def allowed(self, unit: str) -> str:
        """Limits of PASS in words."""
        low, high = self.passes
        unit = "" if unit == "1" else f" {unit}"
        if low is None:
            return "anything" if high is None else f"at most {high:g}{unit}"
        return f"at least {low:g}{unit}" if high is None else f"{low:g} to {high:g}{unit}"


@dataclass(frozen=True, slots=True)
class Verdict:
    """Overall verdict, the worst of all judgements, which are in the order of the stages."""

    judgements: tuple[Judgement, ...]

    @property
    def word(self) -> str:
        """PASS, WARN or FAIL; WARN if nothing was judged."""
        return max((j.word for j in self.judgements), key=WORDS.index, default=WARN)

    def of(self, about: str) -> "Verdict":
        """Return the part of the verdict on the calibration, or on the search."""
        return Verdict(tuple(j for j in self.judgements if j.about == about))

    @property
    def reasons(self) -> tuple[str, ...]:
        """Sentences of what does not pass, failures first, within them causes first."""
        if not self.judgements:
            return (NOTHING,)
        return tuple(j.reason for word in (FAIL, WARN) for j in self.judgements if j.word == word)


def _within(value: float, limits: Limits) -> bool:
    low, high = limits
    return (low is None or value >= low) and (high is None or value <= high)  # False for NaN
