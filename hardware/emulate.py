"""`python -m hardware.emulate nose=scd30 arm=feetech air=draft`: emulated devices at ptys, until Ctrl-C. Exit code 2 for bad input."""

import os
import select
import shlex
import signal
import sys
from collections.abc import Callable, Sequence
from typing import Any

from oio.core import startup
from oio.core.standard_output import ended

startup.handle_signals(__name__)

import hydra
from hydra.utils import instantiate

from hardware.backends.mujoco_sim import MujocoSim
from hardware.emulators import faults, options
from hardware.emulators.emulated_bench import EmulatedBench, emulate_bench
from oio.cli.exit_codes import run_command
from oio.core.folders import CONF

KEYS = CONF / "emulate.yaml"
# Servos have absolute encoders. With the paper's drift a joint at its limit would be pressed against its stop, and the guard would stop it.
DRIFTLESS = "arm.encoder_drift_deg_s2=0"
ALWAYS_SET = ("sensor", "dof", "seed", "air", "source.position")  # keys that the printed command line sets in any case
HEADER = """Emulated devices on the real wire protocols, with the simulated bench behind them.

  python -m hardware.emulate                                    an SCD30 and a Feetech arm
  python -m hardware.emulate nose=line sensor=mox_mq arm=none   one sensor at a microcontroller
  python -m hardware.emulate faults=nose.unplug@20:3+arm.noise@31

When it is up it prints the command line that connects to it. Ctrl-C ends it.
"""


def main(arguments: list[str] | None = None) -> int:
    """Run the emulators until they are stopped; return the exit code."""
    return run_command(lambda: _run(sys.argv[1:] if arguments is None else arguments))


def _run(arguments: Sequence[str]) -> None:
    if {"--help", "-h"} & set(arguments):
        sys.stdout.write(_help())
        return
    chosen, overrides = options.read(arguments, KEYS)
    overrides = [DRIFTLESS, *overrides]  # overrides given by the user come later and take precedence
    is_stopped = _stop_signal()
    cfg = _composed(overrides)
    sim: MujocoSim = instantiate(cfg.backend)
    with emulate_bench(chosen, sim) as bench:
        sys.stdout.write(f"{_connect_command(chosen, cfg, overrides, bench)}\n")
        sys.stdout.flush()
        bench.loop.run(lambda: is_stopped() or (chosen.until_eof and _at_eof()))
        slipped_s = bench.loop.realtime.slipped_s
    if slipped_s > 0:
        sys.stderr.write(f"oio: the bench could not keep up and gave up {slipped_s:.1f} s; type a lower speed=.\n")


def _composed(overrides: list[str]) -> Any:
    with hydra.initialize_config_dir(str(CONF), version_base="1.3"):
        return hydra.compose("config", overrides)


def _stop_signal() -> Callable[[], bool]:
    """Return a function that reports whether SIGINT or SIGTERM has been received since this call."""
    received = list[int]()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda number, frame: received.append(number))
    return lambda: bool(received)


def _at_eof() -> bool:
    return bool(select.select([sys.stdin], [], [], 0.0)[0]) and not os.read(sys.stdin.fileno(), 4096)


def _connect_command(chosen: options.EmulatorOptions, cfg: Any, overrides: Sequence[str], bench: EmulatedBench) -> str:
    """Command line of a run that connects to the bench."""
    words = ["backend=serial", f"sensor={cfg.sensor.name}", f"dof={cfg.dof}", f"seed={cfg.seed}", f"air={cfg.air.name}"]
    words += [word for word in overrides if word.partition("=")[0] not in ALWAYS_SET and not word.startswith("backend.")]
    for key in ("nose", "arm", "valve"):
        words.append(f"backend.{key}.driver={getattr(chosen, key)}")
        words += [f"backend.{key}.port={bench.ports[key]}"] if key in bench.ports else []
    words += [f"backend.speed={chosen.speed:g}", _position("source", bench)]
    words += _time_out_overrides(cfg, words, chosen.speed)
    words += [_position("beacon", bench)] if cfg.beacon.position is None else []
    return "python -m oio.run " + shlex.join(words)


def _time_out_overrides(cfg: Any, words: Sequence[str], speed: float) -> list[str]:
    """Overrides of the time-outs for a fast bench: a stall of the host takes `speed` times as long in bench time."""
    if speed <= 1.0:
        return []
    with_backend = _composed(["backend=serial", "backend.nose.driver=line", "backend.nose.port=none"])
    timeouts = {f"backend.timeouts.{key}": with_backend.backend.timeouts[key] for key in ("connect_s", "receive_s")}
    waits = {"safety.heartbeat_timeout_s": cfg.safety.heartbeat_timeout_s, **timeouts}
    given = {word.partition("=")[0] for word in words}
    return [f"{key}={seconds * speed:g}" for key, seconds in waits.items() if key not in given]


def _position(source: str, bench: EmulatedBench) -> str:
    position_m = bench.plant.places[source]
    assert position_m is not None
    return f"{source}.position=[{','.join(f'{x:.6f}' for x in position_m)}]"


def _help() -> str:
    kinds = faults.kinds("line", "feetech", "line")
    lines = "\n".join(f"  {device}.{kind:<10} {text}" for device, each in kinds.items() for kind, text in each.items())
    own = KEYS.read_text(encoding="utf-8").rstrip()
    return f"{HEADER}\n{own}\n\nFaults (clock: with nose=line alone, dead: with the others):\n{lines}\n"


if __name__ == "__main__":
    sys.exit(ended(main))
