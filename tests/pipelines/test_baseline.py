"""Five readings of clean air: an element that says nothing ends the stage and not the patience."""

from types import SimpleNamespace

import pytest

from oio.core.errors import NotSettled
from oio.core.records import GasSample, nanoseconds


class Air:
    """A world in which only some elements speak."""

    def __init__(self, speaking, raw):
        self.t_ns, self._speaking, self._raw = 0, speaking, raw

    def samples(self, for_s):
        self.t_ns += nanoseconds(for_s)
        return [GasSample(self.t_ns, element, self._raw) for element in self._speaking]


@pytest.mark.parametrize(("speaking", "said"), [((), "only 0 and 0 readings"), ((1,), "only 0 and 5 readings")])
def test_an_element_that_says_nothing_of_use_is_not_waited_for_for_ever(built, speaking, said):
    stage, sensor = built("stage.baseline", "sensor=ec"), built("sensor", "sensor=ec")
    log = SimpleNamespace(reading=lambda reading: None)
    context = SimpleNamespace(world=Air(speaking, sensor.raw(0.0)), log=log)
    with pytest.raises(NotSettled, match=said):
        stage.run(context)
    assert 120.0 < 1e-9 * context.world.t_ns < 122.0
