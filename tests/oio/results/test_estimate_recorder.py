"""Estimates of the filters that are run over a log again: at a rate, at every map, of the variants that are asked for."""

from types import SimpleNamespace

import numpy as np

from oio.core.records import SECOND_NS
from oio.results.estimate_recorder import EstimateRecorder

PLACE = (np.array([0.1, 0.2, 0.3]), np.eye(3))
FOUND = SimpleNamespace(nose=lambda: PLACE, source=lambda: PLACE)
NOTHING = SimpleNamespace(nose=lambda: None, source=lambda: None)


def times(recorder):
    return [(one.variant, one.t_ns) for one in recorder.estimates]


def test_an_estimate_comes_at_a_rate_and_at_every_map():
    recorder = EstimateRecorder(("cold",), 0.5)
    for tenth in range(8):
        recorder.add(tenth * SECOND_NS // 10, "cold", FOUND, mapped=tenth == 6)
    assert times(recorder) == [("cold", 0), ("cold", SECOND_NS // 2), ("cold", 6 * SECOND_NS // 10)]


def test_other_variants_and_filters_without_a_map_leave_nothing():
    recorder = EstimateRecorder(("cold",), 0.0)
    recorder.add(0, "calibrated", FOUND)
    recorder.add(0, "cold", NOTHING, mapped=True)
    assert times(recorder) == []
    recorder.add(1, "cold", FOUND)  # at once when there is one
    assert times(recorder) == [("cold", 1)]
