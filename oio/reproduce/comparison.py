"""Two runs compared to the bit: readings, what they believed, their innovations, and the files of their results."""

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np

from oio.core.errors import BadInput
from oio.core.records import Belief, FilterEstimate, GasReading, Innovation, seconds
from oio.log import read_attachment, read_beliefs, read_filter_estimates, read_innovations, read_readings

CALIBRATION, SUMMARY = "calibration.yaml", "summary.json"
NOT_COMPARED = ("wall_s", "reproducible")  # of the computer and its tree, not of the estimates
OF_A_REPLAY = ("backend", "world")  # that differ by nature


@dataclass(frozen=True, slots=True)
class Compared:
    """One thing that two runs have: equal or not (None: one of them lacks it), and a few words on it."""

    what: str
    equal: bool | None
    text: str


def compare(before: Path, now: Path, replayed: bool) -> list[Compared]:
    """Compare two logs and the results beside them."""
    return [
        _records("readings", before, now, read_readings, _reading_bits),
        _records("beliefs", before, now, read_beliefs, _belief_bits),
        _records("innovations", before, now, read_innovations, _innovation_bits),
        _records("cold starts", before, now, read_filter_estimates, _estimate_bits, lacking=True),
        _texts(CALIBRATION, _calibration(before), _calibration(now)),
        _texts(SUMMARY, _summary(before, replayed), _summary(now, replayed)),
    ]


def _records(
    what: str, before: Path, now: Path, read: Callable[[Path], Iterator[Any]], bits: Callable[[Any], bytes], lacking: bool = False
) -> Compared:  # fmt: skip
    """Compare record by record; `lacking`: logs of earlier versions may have none."""
    count = 0
    for old, new in zip_longest(read(before), read(now)):
        if count == 0 and lacking and (old is None or new is None):
            return Compared(what, None, f"only {'now' if old is None else 'before'}")
        if old is None or new is None:
            return Compared(what, False, f"one run has more than {count}")
        if bits(old) != bits(new):
            return Compared(what, False, f"number {count} differs, at {seconds(old.t_ns):.3f} s")
        count += 1
    return Compared(what, True, f"{count}, equal to the bit")


def _reading_bits(reading: GasReading) -> bytes:
    return np.array([reading.ppm, reading.sigma_ppm]).tobytes() + str((reading.t_ns, reading.element)).encode()


def _belief_bits(belief: Belief) -> bytes:
    return b"".join((str(belief.t_ns).encode(), b" ", belief.mean.tobytes(), belief.cov.tobytes()))


def _estimate_bits(one: FilterEstimate) -> bytes:
    numbers = np.concatenate([a.ravel() for a in (one.nose_m, one.nose_cov, one.source_m, one.source_cov)])
    return str((one.t_ns, one.variant)).encode() + numbers.tobytes()


def _innovation_bits(one: Innovation) -> bytes:
    return b"".join((str((one.t_ns, one.gated)).encode(), one.residual.tobytes(), one.cov.tobytes()))


def _texts(what: str, before: dict[str, Any] | None, now: dict[str, Any] | None) -> Compared:
    if before is None or now is None:
        return Compared(what, None, "not there" if before is now else f"only {'now' if before is None else 'before'}")
    differing = [key for key in before if key in now and before[key] != now[key]]  # other versions may have added fields
    return Compared(what, not differing, f"differs in {', '.join(differing)}" if differing else "equal")


def _calibration(log: Path) -> dict[str, Any] | None:
    """The file beside the log, else the attachment in it, by its bytes."""
    path = log.parent / CALIBRATION
    try:
        return {"its bytes": path.read_bytes() if path.is_file() else read_attachment(log, CALIBRATION)}
    except BadInput:
        return None


def _summary(log: Path, replayed: bool) -> dict[str, Any] | None:
    path = log.parent / SUMMARY
    if not path.is_file():
        return None
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except ValueError:
        raise BadInput(f"{path} is no JSON. Take the file that the run has written, or put it away.") from None
    ignored = (*NOT_COMPARED, *(OF_A_REPLAY if replayed else ()))
    return {key: value for key, value in document.items() if key not in ignored}
