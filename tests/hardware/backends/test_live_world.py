"""The order in which a live bench gives away what its devices left in the mailbox."""

from types import SimpleNamespace

import numpy as np
import pytest

from hardware.backends.live_world import LiveDevices, LiveWorld
from hardware.transport.mailbox import Mailbox, StampedSample
from oio.core.records import SECOND_NS, Event, GasSample, JointState

MS = SECOND_NS // 1000
HOLD_S = 0.06


@pytest.fixture
def bench():
    """A bench whose devices are this test, its mailbox and its clock, of which every look takes 1 ms."""
    box, zero = Mailbox(1000), np.zeros(5)
    clock = SimpleNamespace(t_ns=0, host_s=lambda s: 1e-6 * s)

    def now_ns():
        clock.t_ns += MS
        return clock.t_ns

    clock.now_ns = now_ns
    driver = SimpleNamespace(key="backend.nose", name="line", counts=dict)
    nose = SimpleNamespace(check=lambda: None, news=[], driver=driver, reconnects=0, away_ns=0)
    mover = SimpleNamespace(heartbeat=lambda: None, held=None)
    valve = SimpleNamespace(poll=lambda: None)
    live = LiveWorld(LiveDevices(nose, None, mover, valve), clock, box, None, {}, HOLD_S)
    clock.t_ns = 0

    def joints(*at_ms):
        for t in at_ms:
            box.put(StampedSample(JointState(t * MS, zero, zero, zero), t * MS))

    def gas(*at_ms):
        for t in at_ms:
            box.put(StampedSample(GasSample(t * MS, 0, 1.0), t * MS))

    return SimpleNamespace(live=live, box=box, clock=clock, joints=joints, gas=gas)


def _given(bench, for_s):
    """(ms of its stamp, ms when it was given) of every sample."""
    return [(s.t_ns // MS, bench.clock.t_ns // MS, type(s)) for s in bench.live.samples(for_s) if not isinstance(s, Event)]


def test_a_fixed_nose_has_no_guard_to_account_for(bench):
    assert bench.live.guard_account() is None


def test_joints_wait_for_gas_that_may_be_older(bench):
    bench.joints(10, 20, 30)
    for stamped_ms, given_ms, _ in _given(bench, 0.1):
        assert given_ms >= stamped_ms + 1e3 * HOLD_S


def test_joints_older_than_any_gas_to_come_wait_for_nothing(bench):
    bench.joints(10, 20, 30)
    bench.box.no_gas_before(25 * MS)
    (first, second, third) = _given(bench, 0.1)
    assert first[1] < 25 and second[1] < 25 < 30 + 1e3 * HOLD_S <= third[1]


def test_all_come_in_the_order_of_their_stamps_and_gas_at_once(bench):
    bench.joints(10, 20, 30)
    bench.gas(25)
    given = _given(bench, 0.1)
    assert [t for t, _, _ in given] == [10, 20, 25, 30]
    assert given[2][1] < 30 and given[2][2] is GasSample


def test_a_broken_promise_is_counted_and_the_log_stays_in_order(bench):
    bench.joints(10, 20, 30)
    bench.box.no_gas_before(25 * MS)
    given = iter(bench.live.samples(0.1))
    before = [next(s for s in given if isinstance(s, JointState)) for _ in range(2)]
    bench.gas(15)
    late = next(s for s in given if isinstance(s, GasSample))
    assert late.t_ns == before[-1].t_ns == 20 * MS
    assert "late 1" in str(bench.live.account)
