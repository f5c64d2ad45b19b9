"""A settings class refuses what does not fit it, names the field, and stays as it is."""

import dataclasses
from typing import Annotated, ClassVar

import pytest
from hypothesis import given
from hypothesis import strategies as st

from oio.core.errors import BadInput
from oio.core.settings import Within, refuse_below, settings


@settings
class Probe:
    """Every kind of field that conf/ uses."""

    kind: ClassVar[str] = "probe"
    gain: float
    count: Annotated[int, Within(1, 9)]
    name: str
    place: tuple[float, float, float] | None
    sides: Annotated[tuple[float, ...], Within(0, 1e12)]
    windows: dict[int, int]
    tilts: Annotated[dict[str, float | None], Within(-1, 1, "cosine of an angle")]
    corners: tuple[tuple[float, float], ...]
    on: bool

    def check(self) -> None:
        """Refuse a gain below the count."""
        refuse_below(self, "gain", "count")


GOOD = {"gain": 2.5, "count": 2, "name": "x", "place": (0.0, 1.0, 2.0), "sides": (1.0,), "windows": {1: 3}, "on": True}
GOOD |= {"tilts": {"x": 0.5}, "corners": ((0.0, 1.0),)}


def probe(**changes):
    return Probe(**{**GOOD, **changes})


def test_what_fits_is_kept_as_it_is():
    made = probe()
    assert dataclasses.asdict(made) == GOOD and made.kind == "probe"


@given(st.integers(2, 10**9))
def test_whole_numbers_are_floats_where_floats_are_wanted(n):
    made = probe(gain=n, sides=[n, n], place=[n, 0, 1])
    assert made.gain == float(n) and isinstance(made.gain, float)
    assert made.sides == (float(n), float(n)) and all(isinstance(v, float) for v in made.sides)
    assert made.place == (float(n), 0.0, 1.0) and all(isinstance(v, float) for v in made.place)


def test_nothing_is_a_place_where_it_may_be():
    assert probe(place=None).place is None
    with pytest.raises(BadInput, match=r"Probe.sides is null, but it must be a list of numbers"):
        probe(sides=None)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"gain": "fast"}, "Probe.gain is 'fast', but it must be a number"),
        ({"gain": True}, "Probe.gain is true, but it must be a number"),
        ({"count": 2.0}, "Probe.count is 2.0, but it must be a whole number"),
        ({"name": 3}, "Probe.name is 3, but it must be a text"),
        ({"place": (0.0, 1.0)}, r"Probe.place is \[0.0, 1.0\], but it must be three numbers or null"),
        ({"sides": "abc"}, "Probe.sides is 'abc'"),
        ({"windows": {"one": 3}}, "Probe.windows is {.*}, but it must be a whole number for each number"),
        ({"on": 1}, "Probe.on is 1, but it must be true or false"),
        ({"gain": float("nan")}, "Probe.gain is nan, but a finite number is needed"),
        ({"gain": float("inf")}, "Probe.gain is inf, but a finite number is needed"),
        ({"count": 0}, "Probe.count is 0, but 1 to 9 is allowed"),
        ({"count": 10}, "Probe.count is 10, but 1 to 9 is allowed"),
        ({"count": 10**400}, "Probe.count is 1000.*0, but 1 to 9 is allowed"),
        ({"gain": 10**400}, "Probe.gain is inf, but a finite"),
        ({"gain": 1}, "Probe.gain is 1, but it must be at least count, which is 2"),
        ({"sides": [1, -1]}, r"Probe.sides\[1\] is -1, but 0 to 1e\+12 is allowed.$"),
        ({"tilts": {"x": None, "y": 2}}, "Probe.tilts.y is 2, but -1 to 1 is allowed: it is the cosine of an angle."),
    ],
)
def test_what_does_not_fit_is_refused_by_name(changes, said):
    with pytest.raises(BadInput, match=said):
        probe(**changes)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"place": (0.0, float("nan"), 1.0)}, r"Probe\.place\[1\] is nan, but a finite number is needed"),
        ({"sides": [1.0, float("inf")]}, r"Probe\.sides\[1\] is inf, but a finite number is needed"),
        ({"tilts": {"x": -float("inf")}}, r"Probe\.tilts\.x is -inf, but a finite number is needed"),
        ({"corners": ((0.0, 1.0), (2.0, float("nan")))}, r"Probe\.corners\[1\]\[1\] is nan, but a finite number is needed"),
    ],
)
def test_a_number_inside_a_tuple_or_dict_is_finite_too(changes, said):
    with pytest.raises(BadInput, match=said):
        probe(**changes)


def test_unknown_missing_and_positional_fields_are_refused():
    with pytest.raises(TypeError, match="colour"):
        probe(colour="red")
    with pytest.raises(TypeError, match="gain"):
        Probe(**{k: v for k, v in GOOD.items() if k != "gain"})
    with pytest.raises(TypeError):
        Probe(1.5)


def test_it_cannot_be_changed():
    with pytest.raises(dataclasses.FrozenInstanceError):
        probe().gain = 2.0
    assert dataclasses.replace(probe(), gain=2).gain == 2.0
    with pytest.raises(BadInput):
        dataclasses.replace(probe(), gain="x")
