"""Fault injection: fault kinds of each device and their schedule, `nose.unplug@20:3+arm.noise@31` or `random:SEED`."""

import math
import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from oio.core.errors import BadInput

WIRE = {
    "noise": "random bytes, alone and within messages, in both directions",
    "cut": "messages are truncated, in both directions",
    "checksum": "one bit of each message is flipped, in both directions",
    "busy": "it neither receives nor sends",
    "unplug": "its port disappears and returns under the same name; a nose has then lost its settings, a valve is closed",
}
NOSE = {
    "stuck": "the value repeats",
    "saturated": "the value is at its rail",
    "nack": "it refuses every request",
}
DEAD = {"dead": "it answers 0 ppm, its code for no measurement; temperature and humidity go on"}
CLOCK = {"clock": "its milliseconds jump ahead by 10 s, and back at the end"}
ARM = {
    "stuck": "positions repeat",
    "saturated": "loads are at full scale",
    "nack": "it refuses every request",
    "brownout": "its supply fails: it is silent meanwhile, and its torque is off from then on",
    "hot": "the second servo overheats and disables its torque",
}
EXAMPLE = "faults=nose.unplug@20:3+arm.noise@31"


def kinds(nose: str, arm: str, valve: str) -> dict[str, dict[str, str]]:
    """Fault kinds of each device, with a description of each, for the given drivers."""
    all_kinds = {"nose": {**WIRE, **NOSE, **(CLOCK if nose == "line" else DEAD)}}
    if arm != "none":
        all_kinds["arm"] = {**WIRE, **ARM}
    if valve != "none":
        all_kinds["valve"] = dict(WIRE)
    return all_kinds


@dataclass(frozen=True)
class Fault:
    """One fault of one device; times in world seconds since the first request to any device."""

    device: str
    kind: str
    at_s: float
    for_s: float


@dataclass(frozen=True)
class Chance:
    """Parameters of a random fault schedule."""

    count: int
    within_s: float
    longest_s: float


def read(text: str, allowed: Mapping[str, Collection[str]], for_s: float, chance: Chance) -> tuple[Fault, ...]:
    """Parse a fault schedule; `for_s` is the duration of a fault without one. Raises BadInput."""
    if text.startswith("random:"):
        return _drawn(text, allowed, chance)
    return tuple(_fault(word, allowed, for_s) for word in text.split("+"))


def _fault(word: str, allowed: Mapping[str, Collection[str]], for_s: float) -> Fault:
    found = re.fullmatch(r"(\w+)\.(\w+)@(\d+(?:\.\d+)?)(?::(\d+(?:\.\d+)?))?", word, re.ASCII)
    if found is None:
        raise BadInput(f"faults={word} was given, but a fault is DEVICE.KIND@SECONDS[:DURATION], or random:SEED. Type e.g. {EXAMPLE}.")
    device, kind = found[1], found[2]
    if device not in allowed:
        raise BadInput(f"faults={word} was given, but what is emulated is {', '.join(allowed)}. Type e.g. {EXAMPLE}.")
    if kind not in allowed[device]:
        raise BadInput(f"faults={word} was given, but the {device} can have {', '.join(allowed[device])}. Type e.g. {EXAMPLE}.")
    return Fault(device, kind, float(found[3]), for_s if found[4] is None else float(found[4]))


def _drawn(text: str, allowed: Mapping[str, Collection[str]], chance: Chance) -> tuple[Fault, ...]:
    seed = text.removeprefix("random:")
    if not (seed.isascii() and seed.isdecimal()):
        raise BadInput(f"faults={text} was given, but a seed is a whole number, 0 or more. Type e.g. faults=random:7.")
    rng = np.random.default_rng(int(seed))
    choices = [(device, kind) for device, kinds in allowed.items() for kind in kinds]
    return tuple(_random(rng, choices, chance) for _ in range(chance.count))


def _random(rng: np.random.Generator, choices: list[tuple[str, str]], chance: Chance) -> Fault:
    """Draw one fault; its duration is log-uniform."""
    device, kind = choices[int(rng.integers(len(choices)))]
    for_s = math.exp(rng.uniform(math.log(0.01 * chance.longest_s), math.log(chance.longest_s)))
    return Fault(device, kind, round(float(rng.uniform(0.0, chance.within_s)), 2), round(for_s, 2))


def active_kinds(faults: Iterable[Fault], device: str, t_s: float) -> set[str]:
    """Return the fault kinds active on a device at t_s."""
    return {fault.kind for fault in faults if fault.device == device and fault.at_s <= t_s < fault.at_s + fault.for_s}


def corrupt(data: bytes, trouble: Collection[str], rng: np.random.Generator) -> bytes:
    """Return a message as corrupted by the active wire faults."""
    if "checksum" in trouble:
        at = int(rng.integers(len(data)))
        data = data[:at] + bytes((data[at] ^ 1 << int(rng.integers(8)),)) + data[at + 1 :]
    if "cut" in trouble:
        data = data[: int(rng.integers(len(data)))]
    if "noise" in trouble:
        at = int(rng.integers(len(data) + 1))
        data = data[:at] + rng.bytes(int(rng.integers(1, 9))) + data[at:]
    return data
