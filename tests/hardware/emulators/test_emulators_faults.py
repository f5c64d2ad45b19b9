"""Faults of emulated devices: read from words or drawn, active when they say, and what they leave of a message."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hardware.emulators.faults import ARM, NOSE, WIRE, Chance, Fault, active_kinds, corrupt, kinds, read
from oio.core.errors import BadInput

CHANCE = Chance(count=4, within_s=100.0, longest_s=10.0)
ALL = kinds("line", "feetech", "line")


def parsed(text, nose="line", arm="feetech", valve="line"):
    return read(text, kinds(nose, arm, valve), 1.5, CHANCE)


def test_words_are_read_as_they_are_meant():
    assert parsed("nose.unplug@20:3+arm.noise@31.5") == (Fault("nose", "unplug", 20.0, 3.0), Fault("arm", "noise", 31.5, 1.5))


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("nose.unplug", r"DEVICE.KIND@SECONDS"),
        ("nose.unplug@-3", r"DEVICE.KIND@SECONDS"),
        ("nose.unplug@3:", r"DEVICE.KIND@SECONDS"),
        ("", r"DEVICE.KIND@SECONDS"),
        ("nose.unplug@3+", r"DEVICE.KIND@SECONDS"),
        ("pump.unplug@3", r"what is emulated is nose, arm, valve"),
        ("valve.stuck@3", r"the valve can have noise"),
        ("arm.clock@3", r"the arm can have noise, .*hot"),
        ("random:", r"a whole number"),
        ("random:-1", r"a whole number"),
        ("random:x", r"a whole number"),
    ],
)
def test_others_are_refused_with_what_to_type(text, says):
    with pytest.raises(BadInput, match=rf"{says}.*Type e\.g\. faults="):
        parsed(text)


def test_what_a_device_cannot_have_is_refused():
    with pytest.raises(BadInput, match="the nose can have"):
        parsed("nose.clock@3", nose="scd30")
    with pytest.raises(BadInput, match="what is emulated is nose"):
        parsed("arm.noise@3", arm="none")
    with pytest.raises(BadInput, match="what is emulated is nose, arm\\."):
        parsed("valve.noise@3", valve="none")


@given(st.integers(0, 2**40))
def test_drawn_schedules_are_such_as_could_be_typed(seed):
    drawn = parsed(f"random:{seed}")
    assert len(drawn) == CHANCE.count and drawn == parsed(f"random:{seed}")
    assert drawn == parsed("+".join(f"{f.device}.{f.kind}@{f.at_s}:{f.for_s}" for f in drawn))
    assert all(0 <= f.at_s <= CHANCE.within_s and 0.1 <= f.for_s <= CHANCE.longest_s for f in drawn)


def test_draws_differ_and_leave_nothing_out():
    drawn = [fault for seed in range(200) for fault in parsed(f"random:{seed}")]
    assert {(f.device, f.kind) for f in drawn} == {(device, kind) for device, each in ALL.items() for kind in each}
    assert len({f.at_s for f in drawn}) > 500


@given(st.floats(0, 100), st.floats(0.01, 10), st.floats(0, 200))
def test_a_fault_is_active_from_its_beginning_to_its_end(at_s, for_s, t_s):
    fault = Fault("nose", "noise", at_s, for_s)
    assert active_kinds([fault], "nose", t_s) == ({"noise"} if at_s <= t_s < at_s + for_s else set())
    assert active_kinds([fault], "arm", t_s) == set()


@given(st.binary(min_size=1, max_size=60), st.integers(0, 1000))
def test_what_is_left_of_a_message(data, seed):
    rng = np.random.default_rng(seed)
    assert corrupt(data, set(), rng) == data
    cut = corrupt(data, {"cut"}, rng)
    assert data.startswith(cut) and len(cut) < len(data)
    turned = corrupt(data, {"checksum"}, rng)
    assert len(turned) == len(data) and (int.from_bytes(turned, "big") ^ int.from_bytes(data, "big")).bit_count() == 1
    noisy = corrupt(data, {"noise"}, rng)
    assert len(data) < len(noisy) <= len(data) + 8
    assert any(noisy[:at] + noisy[at + len(noisy) - len(data) :] == data for at in range(len(data) + 1))
    assert isinstance(corrupt(data, {"noise", "cut", "checksum"}, rng), bytes)


def test_every_kind_has_a_sentence_of_its_own():
    for each in (WIRE, NOSE, ARM):
        assert len(set(each.values())) == len(each) and all(each.values())
