"""Warm-up: both stopping rules wait for a sensor that drifts, a drift record is as long as asked for, a recording knows its time-outs."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from oio.core.errors import BadInput, NotSettled
from oio.core.records import GasSample, nanoseconds, seconds

RECORDINGS = {
    "airscout32": (1800, 300), "co2_scd30x4": (600, 120), "orebro3dsen": (120, 120), "scd30_windows": (14400, 600),
    "sgp30_64h": (3600, 600), "smellnet": (300, 120), "waag_ec": (604800, 259200),
}  # fmt: skip


class Room:
    """Clean air in front of a sensor of one element, whose reading decays to rest with a time constant."""

    def __init__(self, sensor, height_ppm, tau_s):
        self.t_ns, self._sensor, self._height_ppm, self._tau_s = 0, sensor, height_ppm, tau_s
        self._rng, self.spans = np.random.default_rng(0), []

    def present(self, source):
        assert source == "none"

    def samples(self, for_s):
        self.spans.append(for_s)
        for _ in range(max(round(for_s / self._sensor.sample_s), 1)):
            self.t_ns += nanoseconds(self._sensor.sample_s)
            ppm = 420.0 + self._height_ppm * np.exp(-seconds(self.t_ns) / self._tau_s) + self._rng.standard_normal()
            yield GasSample(self.t_ns, 0, self._sensor.raw(ppm))


def run(built, height_ppm=0.0, tau_s=12.0, **changes):
    """Run the stage; returns its result, the world and the readings that were logged."""
    stage, readings = dataclasses.replace(built("stage.warm_up", "sensor=ndir"), **changes), []
    world = Room(built("sensor", "sensor=ndir"), height_ppm, tau_s)
    log = SimpleNamespace(reading=readings.append, progress=lambda *_: None)
    return stage.run(SimpleNamespace(world=world, log=log)), world, readings


@pytest.mark.parametrize("rule", ["slope", "kpss"])
def test_both_rules_wait_for_a_sensor_that_drifts(built, rule):
    still, drifting = (run(built, height_ppm, rule=rule)[0] for height_ppm in (0.0, 300.0))
    assert still.waited_s < 15.0 and drifting.waited_s > 45.0
    with pytest.raises(NotSettled, match="still drifts"):
        run(built, 3000.0, tau_s=600.0, rule=rule)


def test_the_drift_record_follows_the_warm_up_and_is_as_long_as_asked_for(built):
    plain, _, few = run(built)
    settled, world, many = run(built, drift_record_s=50.0)
    assert dataclasses.replace(settled, drift=None) == plain  # what the warm-up found does not depend on it
    assert settled.drift.span_s == pytest.approx(50.0) and settled.drift.slope < 0.5
    assert len(many) - len(few) == 500 and world.spans[-1] == 50.0


def test_a_record_of_a_sensor_that_drifts_is_steep_and_a_short_one_says_nothing(built):
    drifting = run(built, 3000.0, tau_s=600.0, drift_record_s=60.0, rule="slope", window_s=0.0, readings=4, max_s=1e5)
    assert drifting[0].drift.slope > 0.95
    assert run(built, drift_record_s=1.0)[0].drift is None


def test_by_default_no_drift_is_recorded_and_no_span_is_asked_for(built):
    _, world, _ = run(built)
    assert built("stage.warm_up").drift_record_s == 0.0 and built("stage.warm_up").rule == "slope"
    assert set(world.spans) == {0.1}


@pytest.mark.parametrize(
    ("changes", "said"), [({"rule": "trend"}, "it can be slope or kpss"), ({"drift_record_s": -1.0}, "drift_record_s")]
)
def test_what_cannot_be_is_refused(built, changes, said):
    with pytest.raises(BadInput, match=said):
        dataclasses.replace(built("stage.warm_up"), **changes)


@pytest.mark.parametrize(("recording", "limits_s"), RECORDINGS.items())
def test_a_recording_knows_its_time_outs_and_the_command_line_has_the_last_word(composed, recording, limits_s):
    made = composed("backend=recording", f"recording={recording}")
    assert (made.stage.warm_up.max_s, made.stage.baseline.max_s) == limits_s
    typed = composed("backend=recording", f"recording={recording}", "stage.warm_up.max_s=7")
    assert typed.stage.warm_up.max_s == 7


def test_without_a_recording_they_are_two_minutes(built):
    assert (built("stage.warm_up").max_s, built("stage.baseline").max_s) == (120.0, 120.0)
