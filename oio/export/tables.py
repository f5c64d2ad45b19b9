"""Tables of a run: tracks, readings, joints. The time comes first, units end the names, NaN stands where nothing was logged at a time."""

from collections.abc import Mapping

import numpy as np

from oio.core.errors import BadInput
from oio.core.records import Array, seconds
from oio.export.run_record import DEAD_RECKONING, ESTIMATE, TRUTH, RunRecord, stamps_s
from oio.figures.track import TrackOverTime
from oio.kinematics.forward import SLIDE

Table = Mapping[str, Array]  # columns of one length
UPPER = {"xx": (0, 0), "xy": (0, 1), "xz": (0, 2), "yy": (1, 1), "yz": (1, 2), "zz": (2, 2)}


def tables(run: RunRecord) -> dict[str, Table]:
    """Return the tables of a run by name; those without a row are left out. Raises BadInput if that leaves none."""
    made = {"tracks": _tracks(run), "readings": _readings(run), "joints": _joints(run)}
    found = {name: table for name, table in made.items() if len(table["t_s"])}
    if not found:
        raise BadInput(f"{run.log} holds no sample: the run was stopped before its first. Give another run.")
    return found


def _tracks(run: RunRecord) -> Table:
    """Nose as estimated, by dead reckoning and in truth; source as estimated and in truth, at all their stamps."""
    estimate, truth = run.noses[ESTIMATE], run.noses[TRUTH]
    tracks = {"estimate": estimate, DEAD_RECKONING: run.noses[DEAD_RECKONING], "source": run.source}
    tracks |= {"truth": truth, "truth_source": run.true_source}
    t_s = np.unique(np.concatenate([track.t_s for track in tracks.values()]))
    columns = {"t_s": t_s}
    for name, track in tracks.items():
        columns |= _track(name, track, t_s, name in ("estimate", "source")) if len(track) else {}
    return columns | ({"truth_ppm": _at(t_s, truth.t_s, run.truth_ppm)} if len(truth) else {})


def _track(name: str, track: TrackOverTime, t_s: Array, uncertain: bool) -> dict[str, Array]:
    columns = {f"{name}_{axis}_m": _at(t_s, track.t_s, track.p_m[:, i]) for i, axis in enumerate("xyz")}
    if uncertain:
        columns |= {f"{name}_cov_{pair}_m2": _at(t_s, track.t_s, track.cov_m2[:, i, j]) for pair, (i, j) in UPPER.items()}
    return columns


def _at(t_s: Array, known_s: Array, values: Array) -> Array:
    """Values known at some of the stamps t_s, and NaN at the others."""
    found = np.full(len(t_s), np.nan)
    found[np.searchsorted(t_s, known_s)] = values
    return found


def _readings(run: RunRecord) -> Table:
    """Raw samples and what they mean; beside these the ppm of each element in a column of its own, because a plot has no groups."""
    read = {(reading.t_ns, reading.element): reading for reading in run.readings}
    found = [read.get((sample.t_ns, sample.element)) for sample in run.samples]
    ppm, sigma = (np.array([np.nan if r is None else getattr(r, name) for r in found]) for name in ("ppm", "sigma_ppm"))
    element, raw = (np.array([getattr(sample, name) for sample in run.samples]) for name in ("element", "raw"))
    columns = {"t_s": stamps_s(run.samples), "element": element, "raw": raw, "ppm": ppm, "sigma_ppm": sigma}
    return columns | {f"element_{e}_ppm": np.where(element == e, ppm, np.nan) for e in sorted(set(element.tolist()))}


def _joints(run: RunRecord) -> Table:
    """Position, velocity and acceleration of every moving joint, from the encoders: in rad, of a sliding joint in m."""
    names = run.identity.get("joints", "").split()
    if any(len(state.q) != len(names) for state in run.joints):
        raise BadInput(f"{run.log} names {len(names)} joints, but its joint states have another number. Give the log of an OIO run.")
    columns = {"t_s": np.array([seconds(state.t_ns) for state in run.joints])}
    for j, name in enumerate(names):
        unit = "m" if run.arm is not None and run.arm.chain.kinds[j] == SLIDE else "rad"
        for quantity, per in (("q", ""), ("dq", "_s"), ("ddq", "_s2")):
            columns[f"{name}_{quantity}_{unit}{per}"] = np.array([getattr(state, quantity)[j] for state in run.joints])
    return columns
