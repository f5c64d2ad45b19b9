"""TUM trajectories: a line `t x y z qx qy qz qw` per pose, as evo reads them (`evo_ape tum truth.tum estimate.tum`)."""

from pathlib import Path

from oio.core.errors import BadInput
from oio.export.run_record import RunRecord

NO_ROTATION = "0 0 0 1"
COLUMNS = "# t [s since the world opened] x y z [m, frame base] qx qy qz qw [the rotation is not estimated: none is written]"


def write_tum(run: RunRecord, folder: Path) -> list[Path]:
    """Write a file per nose trajectory of the run, e.g. estimate.tum: every digit of the log. Returns their paths.

    Stamps are those of the log, so that tracks can be compared at common stamps. Raises BadInput where the log holds no trajectory.
    """
    tracks = {name: track for name, track in run.noses.items() if len(track)}
    if not tracks:
        raise BadInput(f"{run.log} holds no trajectory of the nose: no joint moved, and nothing was estimated. Give another run.")
    for name, track in tracks.items():
        head = f"# OIO: {name.replace('_', ' ')} of the nose, {run.title}\n{COLUMNS}\n"
        rows = zip(track.t_s.tolist(), track.p_m.tolist(), strict=True)
        lines = (f"{t_s!r} {x!r} {y!r} {z!r} {NO_ROTATION}\n" for t_s, (x, y, z) in rows)
        (folder / f"{name}.tum").write_text(head + "".join(lines), encoding="utf-8")
    return [folder / f"{name}.tum" for name in tracks]
