"""What a nose says on its way to the mailbox, and which values go no further."""

import math
from types import SimpleNamespace

import pytest

from hardware.codecs.line import sentence
from hardware.drivers.noses.line import Line, Sentence
from hardware.drivers.noses.poll_schedule import PollSchedule
from hardware.drivers.noses.port import NEVER, NosePort, _noisy
from hardware.drivers.noses.reading_filter import ReadingFilter
from hardware.transport.mailbox import Mailbox
from hardware.transport.port import DeviceLost, NoAnswer, Unplugged
from oio.core.errors import BadInput
from oio.core.records import SECOND_NS

PORT = {"driver": "line", "port": "/dev/null", "talker": "NOSE", "columns": ("ms", "active", "adcA", "adcB"), "stuck_after": 3}


@pytest.fixture
def intake():
    box = Mailbox(100)
    return ReadingFilter(box, 2, 1023.0, 3), box


def test_values_that_are_none_are_dropped_and_those_at_the_rail_counted(intake):
    taken, box = intake
    for i, raw in enumerate([1.0, math.nan, math.inf, 1023.0, 1023.0, 1023.0, 1023.0, 1024.0, 1022.0]):
        taken.put(i, 0, raw, i)
    assert [a.sample.raw for a in box.gas] == [1.0, 1023.0, 1023.0, 1023.0, 1023.0, 1024.0, 1022.0]
    assert taken.counts == {"samples": 2, "not a number": 2, "saturated": 5}


def test_codes_for_no_value_are_counted_and_nothing_else_for_long_ends_the_run(built):
    sensor = built("sensor", "sensor=ndir", "sensor.no_value=[[0,0],[514,518],[65535,65535]]")
    box = Mailbox(100)
    taken = ReadingFilter(box, 1, 1e6, 1000, sensor.is_no_value)
    for i, raw in enumerate([0.0, 514.0, 513.9, 516.5, 518.0, 518.1, 65535.0, 420.0]):
        taken.put(i, 0, raw, i)
    assert [a.sample.raw for a in box.gas] == [513.9, 518.1, 420.0] and taken.counts == {"samples": 3, "no value": 5}
    for i in range(30):
        taken.put(100 + i, 0, 0.0, 100 + i)
    with pytest.raises(DeviceLost, match="31 times in a row with 0, which stands for `no measurement`"):
        taken.put(200, 0, 0.0, 200)


def test_a_range_of_no_values_the_wrong_way_round_is_refused(built):
    with pytest.raises(Exception, match=r"lower end comes first. Type \[514, 518\]"):
        built("sensor", "sensor=ndir", "sensor.no_value=[[518,514]]")


def test_a_value_that_never_changes_is_stuck_per_element(intake):
    taken, box = intake
    for i in range(10):
        taken.put(2 * i, 0, 5.0, 2 * i)
        taken.put(2 * i + 1, 1, float(i), 2 * i + 1)
    assert taken.counts["stuck"] == 7 and sum(a.sample.element == 0 for a in box.gas) == 3 and len(box.gas) == 13
    taken.put(99, 0, 6.0, 99)
    assert box.gas[-1].sample.raw == 6.0  # it moves again


@pytest.mark.parametrize(
    ("overrides", "noisy"), [(("sensor=ec",), True), (("sensor=ndir",), True), (("sensor=mox_mq", "sensor.adc_bits=10"), False)]
)
def test_a_coarse_converter_in_clean_air_is_not_stuck(built, overrides, noisy):
    assert _noisy(built("sensor", *overrides)) is noisy
    assert NEVER > 10**12


def test_a_sensor_that_answers_but_measures_nothing_new_is_started_again():
    clock = SimpleNamespace(now_ns=lambda: clock.t_ns, t_ns=0)
    pace = PollSchedule(clock, 2.0, 2.0)
    clock.t_ns = 9 * SECOND_NS
    pace.check()
    pace.started()
    clock.t_ns = 20 * SECOND_NS
    with pytest.raises(Unplugged, match="nothing new"):
        pace.check()
    pace.new(clock.t_ns)
    pace.check()


def test_nothing_is_asked_before_something_can_be_new():
    clock = SimpleNamespace(now_ns=lambda: clock.t_ns, t_ns=0, host_s=lambda s: 1e-3 * s)
    pace = PollSchedule(clock, 2.0, 2.0)
    assert not pace.rested()
    pace.new(0)
    clock.t_ns = SECOND_NS
    assert pace.rested()
    clock.t_ns = round(1.5 * SECOND_NS)
    assert not pace.rested()


@pytest.mark.parametrize(
    "fields",
    [("5", "A", "1"), ("5", "C", "1", "2"), ("-5", "A", "1", "2"), ("5", "A", "-1", "2"), ("5", "A", "1_0", "2"), ("", "A", "1", "2")],
)
def test_a_sentence_whose_checksum_is_right_but_not_its_fields_is_counted(intake, fields):
    taken, box = intake
    said = sentence("NOSE", *fields) + sentence("NOSE", "6", "A", "1", "2") + sentence("OTHER", "x")
    wire = SimpleNamespace(read=lambda within_s: said, write=lambda data: None)
    nose = Line(taken, SimpleNamespace(now_ns=lambda: SECOND_NS), Sentence("NOSE", PORT["columns"], "AB", 10), 0.1)
    nose.poll(wire)
    assert [a.sample.raw for a in box.gas] == [1.0]
    assert (nose.counts()["good"], nose.counts()["corrupt"]) == (3, 1)


def test_a_nose_with_a_period_promises_when_its_next_value_can_be_stamped_at_the_earliest(intake):
    taken, box = intake
    clock = SimpleNamespace(now_ns=lambda: clock.t_ms * 1_000_000, t_ms=0)
    wire = SimpleNamespace(read=lambda within_s: sentence("NOSE", str(clock.t_ms), "A", str(clock.t_ms), "2"), write=lambda data: None)
    nose = Line(taken, clock, Sentence("NOSE", PORT["columns"], "AB", 10), 0.1)
    promised_ms = []
    for clock.t_ms in (500, 600, 640, 900):  # at first nobody knows its pace; then it is faster than asked, then a frame was lost
        nose.poll(wire)
        promised_ms.append((box.gas_from_ns - box.gas[-1].sample.t_ns) / 1e6)
    assert promised_ms == pytest.approx([-5, 95, 55, 95])


def test_noise_and_other_talkers_are_no_sign_of_life(intake):
    taken, _ = intake
    clock, said = SimpleNamespace(now_ns=lambda: clock.t_ns, t_ns=0), [b""]
    wire = SimpleNamespace(read=lambda within_s: said[0], write=lambda data: None)
    nose = Line(taken, clock, Sentence("NOSE", PORT["columns"], "AB", 10), 0.5)
    for data, t_s, alive in ((sentence("NOSE", "500", "A", "1", "2"), 0.5, True), (b"", 1.0, True), (b"\xff$*x\n", 1.3, False)):
        said[0], clock.t_ns = data, round(t_s * SECOND_NS)
        assert nose.poll(wire) is alive
    said[0] = sentence("MOX", "1500", "A", "1", "2")
    with pytest.raises(NoAnswer, match=r"it says \$MOX, but backend\.nose\.talker is NOSE"):
        nose.poll(wire)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"driver": "scd40"}, "scd30, scd41, line"),
        ({"columns": ("ms", "adcA", "adcB")}, "active is needed"),
        ({"stuck_after": 1}, "stuck_after"),
    ],
)
def test_ports_of_noses_that_make_no_sense_are_refused(given, words):
    with pytest.raises(BadInput, match=words):
        NosePort(**(PORT | given))
