"""Entries of a log to the Rerun viewer: arm, nose, joints, readings, NIS, belief, events. Many rows go together, a few times a second."""

import time
from collections import defaultdict, deque
from collections.abc import Callable
from typing import Any

import numpy as np

from oio.core.quaternions import quaternion
from oio.core.records import Array, Event, GasReading, Innovation, JointState, Truth
from oio.kinematics.link_frames import in_base
from oio.log import ArmFrames, BeliefScene, BelievedNose, Entry, Progress, Setup, StageMark
from oio.log.scene import CHI2_95
from oio.view.column_buffer import ColumnBuffer

TIMELINE = "world"  # time since the world opened
PERIOD_S, SENDING = 0.25, 0.02  # of the wall clock between two sendings at least, and the share of the time that sending takes at most
TRAIL = 600  # places of the nose that are shown behind it: a minute of motion
ARM, NOSE, BELIEVED, BOX, BEACON, SOURCE, SPHERE, HYPOTHESIS = (
    [217, 184, 51], [230, 230, 230], [255, 120, 30], [150, 150, 150], [25, 150, 75], [230, 0, 0], [50, 130, 255], [255, 100, 25],
)  # fmt: skip


class RerunStream:
    """A watcher for `RunLog.watchers`."""

    def __init__(self, recording: Any) -> None:
        import rerun

        self._rerun, self._recording = rerun, recording
        self._scalars = defaultdict[str, ColumnBuffer](ColumnBuffer)
        self._frames, self._noses, self._lines = ColumnBuffer(), ColumnBuffer(), ColumnBuffer()
        self._trail: deque[Array] = deque(maxlen=TRAIL)
        self._joints: Array | None = None
        self._source, self._spheres = b"", True  # the true source that is drawn, and whether range spheres may be
        self._due_s = 0.0  # clock of the display alone

    def __call__(self, entry: Entry) -> None:
        """Take up an entry; send what has gathered if it is time."""
        self._take(entry)
        now = time.monotonic()
        if now >= self._due_s:
            self.flush()
            sent = time.monotonic()
            self._due_s = sent + max(PERIOD_S, (sent - now) / SENDING)

    def _take(self, entry: Entry) -> None:
        match entry:
            case JointState(q=q):
                self._joints = q
            case ArmFrames(t_ns=t_ns):
                self._arm(t_ns, entry)
            case GasReading(t_ns=t_ns, element=element, ppm=ppm):
                self._scalars[f"gas/element_{element}"].add(t_ns, ppm)
            case Innovation(t_ns=t_ns):
                self._nis(t_ns, entry)
            case Truth(t_ns=t_ns, source_m=source_m):
                self._truth(t_ns, source_m)
            case BelievedNose(t_ns=t_ns, nose_m=nose_m):
                self._noses.add(t_ns, nose_m)
            case BeliefScene(t_ns=t_ns):
                self._belief(t_ns, entry)
            case StageMark(t_ns=t_ns, stage=stage, state=state, why=why):
                self._say(t_ns, f"{stage}: {state}{f', {why}' if why else ''}")
            case Progress(t_ns=t_ns, stage=stage, waits_for=waits_for, figure=figure):
                self._say(t_ns, f"{stage}: {waits_for}: {figure}")
            case Event(kind="span" | "progress" | "move"):
                pass  # many, and told otherwise
            case Event(t_ns=t_ns, kind=kind, text=text):
                self._say(t_ns, f"{kind}: {text}")
            case Setup():
                self._setup(entry)

    def flush(self) -> None:
        """Send what has gathered."""
        for path, buffer in self._scalars.items():
            self._send(path, buffer, lambda values: self._rerun.Scalars.columns(scalars=np.array(values)))
        self._send("base/nose_believed", self._noses, lambda places: self._rerun.Points3D.columns(positions=np.array(places)))
        self._send("log", self._lines, lambda lines: self._rerun.TextLog.columns(text=lines))
        self._send("base/arm", self._frames, self._arms)

    def _arms(self, frames: list[ArmFrames]) -> Any:
        """The arm as a line through the origins of its frames; the last of them are the trail of the nose."""
        origins = in_base(np.array([f.places_m for f in frames]), np.array([f.turns for f in frames]))
        self._trail.extend(origins[:, -1])
        self._log(frames[-1].t_ns, "base/nose_path", self._rerun.LineStrips3D([np.array(self._trail)], radii=0.001, colors=NOSE))
        return self._rerun.LineStrips3D.columns(strips=list(origins))

    def _arm(self, t_ns: int, frames: ArmFrames) -> None:
        self._frames.add(t_ns, frames)
        for i, value in enumerate([] if self._joints is None else self._joints.tolist()):
            self._scalars[f"joints/{i + 1}"].add(t_ns, value)

    def _nis(self, t_ns: int, innovation: Innovation) -> None:
        try:
            self._scalars["nis"].add(t_ns, innovation.nis)
        except np.linalg.LinAlgError:
            return  # a singular covariance has none

    def _truth(self, t_ns: int, source_m: Array) -> None:
        """The true source, when it is another."""
        if source_m.tobytes() == self._source:
            return
        self._source, open_ = source_m.tobytes(), bool(np.all(np.isfinite(source_m)))
        self._log(t_ns, "base/truth/source", self._rerun.Points3D([source_m] if open_ else [], radii=0.012, colors=SOURCE))

    def _belief(self, t_ns: int, scene: BeliefScene) -> None:
        if len(scene.radii_m) or self._spheres:
            self._log(t_ns, "base/belief/spheres", self._balls(scene.centres_m, scene.radii_m[:, None] * np.ones(3), None, SPHERE))
        self._spheres = len(scene.radii_m) > 0
        bodies = [_ellipsoid(cov) for _, cov in scene.hypotheses]
        centres, half = [mean for mean, _ in scene.hypotheses], [half_m for half_m, _ in bodies]
        self._log(t_ns, "base/belief/hypotheses", self._balls(centres, half, [turn for _, turn in bodies], HYPOTHESIS))

    def _balls(self, centres: Any, half_sizes: Any, quaternions: Any, color: list[int]) -> Any:
        if len(centres) == 0:
            return self._rerun.Ellipsoids3D(centers=[], half_sizes=[])
        return self._rerun.Ellipsoids3D(centers=centres, half_sizes=half_sizes, quaternions=quaternions, colors=color)

    def _setup(self, setup: Setup) -> None:
        rr, (low, high) = self._rerun, setup.box_m
        self._recording.log("base/arm", rr.LineStrips3D.from_fields(radii=0.012, colors=ARM), static=True)
        self._recording.log("base/nose_believed", rr.Points3D.from_fields(radii=0.008, colors=BELIEVED), static=True)
        self._recording.log("base/box", rr.Boxes3D(mins=[low], sizes=[high - low], colors=BOX), static=True)
        if setup.beacon_m is not None:
            self._recording.log("base/beacon", rr.Points3D([setup.beacon_m], radii=0.012, colors=BEACON, labels="beacon"), static=True)

    def _say(self, t_ns: int, text: str) -> None:
        self._lines.add(t_ns, text)

    def _log(self, t_ns: int, path: str, drawn: Any) -> None:
        self._recording.set_time(TIMELINE, duration=np.timedelta64(t_ns, "ns"))
        self._recording.log(path, drawn)

    def _send(self, path: str, buffer: ColumnBuffer, columns: Callable[[list[Any]], Any]) -> None:
        """Send the rows of a buffer, if there are any."""
        if buffer.t_ns:
            times, values = buffer.taken()
            self._recording.send_columns(path, indexes=[self._rerun.TimeColumn(TIMELINE, duration=times)], columns=columns(values))


def _ellipsoid(cov: Array) -> tuple[Array, Array]:
    """Half axes (3,) m and quaternion (4,) of the 95 % ellipsoid of a covariance (3, 3) m^2."""
    variances, axes = np.linalg.eigh(cov)
    axes[:, 0] *= np.copysign(1.0, np.linalg.det(axes))  # eigenvectors may be a mirror, a rotation may not
    return np.sqrt(CHI2_95 * np.maximum(variances, 0.0)), quaternion(axes)
