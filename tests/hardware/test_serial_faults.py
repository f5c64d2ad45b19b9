"""Faults of a nose and an arm during a run: counted in the log, or the end of it with one clear line."""

import pytest

from oio.records import Event

SHORT = "stage=[warm_up,baseline,calibrate_bouts]"
FAULTS = [
    ("nose.noise@2:3", 0, "skipped"),
    ("nose.checksum@2:3", 0, "corrupt"),
    ("nose.cut@2:2", 0, ""),
    ("nose.unplug@3:1", 0, "opened anew 1"),
    ("nose.nack@2:2", 0, ""),
    ("nose.stuck@2:6", 0, "stuck"),
    ("nose.saturated@2:2", 0, "saturated"),
    ("arm.busy@3:0.5", 0, "lost"),
    ("arm.noise@2:3", 0, "skipped"),
    ("arm.unplug@4:1", 0, "opened anew 1"),
    ("arm.hot@4:30", 1, "reports overheating"),
    ("nose.unplug@16:100", 1, "backend.nose.port"),
    ("valve.unplug@16:1", 0, "backend.valve line: its port went away"),
    ("valve.unplug@16:100", 1, "backend.valve.port"),
]


@pytest.mark.parametrize("fault, code, word", FAULTS, ids=[f[0] for f in FAULTS])
@pytest.mark.slow
def test_a_fault_is_counted_or_ends_the_run_with_one_clear_line(emulators, fault, code, word):
    run = emulators("nose=scd30", "arm=feetech", "speed=3", f"faults={fault}").run(SHORT)
    assert run.code in (0, code) and run.code == code, run.said
    if code:
        assert run.said.strip().splitlines()[-1].startswith("oio: ") and word in run.said
    else:
        gaps = [s.text for s in run.samples() if isinstance(s, Event) and s.kind == "gap"]
        assert word in "; ".join([run.account(), *gaps])
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


@pytest.mark.parametrize("seed", range(3))
def test_random_faults_neither_hang_nor_crash_nor_lose_a_sample(emulators, seed):
    schedule(emulators, seed)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3, 200))
def test_two_hundred_random_schedules(emulators, seed):
    schedule(emulators, seed)
