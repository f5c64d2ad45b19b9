"""Faults of a nose and an arm during a run: counted in the log, or the end of it with one clear line."""

import re

import pytest

from oio.core.records import Event

pytestmark = pytest.mark.long

SHORT = "stage=[warm_up,baseline,calibrate_bouts]"
FAULTS = [  # at a time when all devices are set up
    ("nose.noise@14:3", 0, r"skipped [1-9]"),
    ("nose.checksum@14:3", 0, r"lost [1-9]|corrupt [1-9]"),
    ("nose.cut@14:2", 0, r"lost [1-9]|corrupt [1-9]|skipped [1-9]"),
    ("nose.unplug@15:1", 0, "opened anew 1"),
    ("nose.nack@14:2", 0, r"lost [1-9]"),
    ("nose.stuck@14:6", 0, r"stuck [1-9]"),
    ("nose.saturated@14:2", 0, r"saturated [1-9]"),
    ("nose.stuck@9:3600", 1, "only .* readings"),
    ("nose.saturated@9:3600", 1, "only .* readings"),
    ("nose.dead@14:1", 0, r"no value [1-9]"),
    ("nose.dead@9:3600", 1, r"stands for `no measurement` \(sensor.no_value\)"),
    ("nose.clock@14:3", 0, r"clock [1-9]"),
    ("arm.busy@15:0.5", 0, r"lost [1-9]"),
    ("arm.noise@14:3", 0, r"skipped [1-9]"),
    ("arm.cut@14:2", 0, r"lost [1-9]"),
    ("arm.checksum@14:2", 0, r"lost [1-9]"),
    ("arm.nack@15:0.5", 0, r"lost [1-9]"),
    ("arm.stuck@15:20", 1, "something is in its way"),
    ("arm.saturated@15:20", 1, "of its torque for too long"),
    ("arm.unplug@16:1", 0, "opened anew 1"),
    ("arm.busy@16:100", 1, "backend.arm.port"),
    ("arm.brownout@17:0.1", 1, "has let go"),
    ("arm.hot@16:30", 1, "degC hot|reports overheating"),
    ("nose.unplug@16:100", 1, "backend.nose.port"),
    ("valve.unplug@16:1", 0, "backend.valve line: its port went away"),
    ("valve.unplug@16:100", 1, "backend.valve.port"),
]


@pytest.mark.parametrize("fault, code, word", FAULTS, ids=[f[0] for f in FAULTS])
@pytest.mark.slow
def test_a_fault_is_counted_or_ends_the_run_with_one_clear_line(emulators, fault, code, word):
    nose = "line" if "clock" in fault else "scd30"
    run = emulators(f"nose={nose}", "arm=feetech", "speed=3", f"faults={fault}").run(SHORT)
    assert run.code in (0, code) and run.code == code, run.said
    if code:
        assert run.said.strip().splitlines()[-1].startswith("oio: ") and re.search(word, run.said)
    else:
        gaps = [s.text for s in run.samples() if isinstance(s, Event) and s.kind == "gap"]
        assert re.search(word, "; ".join([run.account(), *gaps]))
    assert run.all_accounted()


def schedule(emulators, seed):
    """A random schedule of three faults of nose, arm and valve within the run; drivers take turns."""
    nose, arm = ("scd30", "scd41", "line")[seed % 3], ("feetech", "dynamixel")[seed % 2]
    words = [f"nose={nose}", f"arm={arm}", "speed=4", f"faults=random:{seed}", "random_within_s=25", "random_longest_s=6", f"seed={seed}"]
    bench = emulators(*words)
    run = bench.run("stage=[warm_up,baseline,calibrate_bouts]", within_s=120)  # a run that hangs raises here
    assert run.code in (0, 1, 2), (words, run.said)  # 2: a port was away when it was to be opened
    if run.code:
        lines = [line for line in run.said.strip().splitlines() if line.startswith("oio: ")]
        assert len(lines) == 1, run.said
    if run.log.exists():
        assert run.all_accounted()
    return run


@pytest.mark.parametrize("seed", [2])  # an arm and a nose on a microcontroller
def test_random_faults_neither_hang_nor_crash_nor_lose_a_sample(emulators, seed):
    schedule(emulators, seed)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [seed for seed in range(200) if seed != 2])
def test_two_hundred_random_schedules(emulators, seed):
    schedule(emulators, seed)
