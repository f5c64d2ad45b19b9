"""Rows of one kind to the columns that the Rerun SDK sends in one call, on the time since the world opened."""

from collections.abc import Callable
from typing import Any

import numpy as np

from oio.core.records import Array
from oio.kinematics.link_frames import in_base
from oio.log import ArmFrames, BeliefScene
from oio.view.ellipsoids import Bodies, hypotheses, range_spheres
from oio.view.rerun_layout import NOSE_PATH, TIMELINE

ARM, NOSE_BELIEVED, BELIEF, SPHERES, HYPOTHESES = (
    "base/arm", "base/nose_believed", "base/belief", "base/belief/spheres", "base/belief/hypotheses",
)  # fmt: skip
SOURCE, LINES, VERDICT = "base/truth/source", "log", "verdict"
TIME_OF_DAY = "time of day"  # a second timeline, of logs that a bench has written


class RerunColumns:
    """Sends rows of a path to a recording; any path that is not named here has scalars."""

    def __init__(self, recording: Any) -> None:
        import rerun

        self._rerun, self._recording = rerun, recording
        self._began_ns: int | None = None
        self._nose: Array | None = None  # where the path ended that was sent
        self._sending: dict[str, Callable[[Any, list[Any]], None]] = {
            ARM: self._arm, NOSE_BELIEVED: self._noses, BELIEF: self._belief, SOURCE: self._sources, LINES: self._lines,
            VERDICT: self._verdict,
        }  # fmt: skip

    def began(self, at_ns: int) -> None:
        """Show the time of day as well, of a world that opened so many nanoseconds after 1970."""
        self._began_ns = at_ns

    def send(self, path: str, t_ns: list[int], values: list[Any]) -> None:
        """Send rows: times (k,) ns since the world opened, and k values."""
        times = np.array(t_ns)
        if path in self._sending:
            self._sending[path](times, values)
        else:
            self._put(path, times, self._rerun.Scalars.columns(scalars=np.array(values)))

    def _arm(self, times: Array, frames: list[ArmFrames]) -> None:
        """The arm as a line through the origins of its frames; the last of them go on with the path of the nose."""
        origins = in_base(np.array([f.places_m for f in frames]), np.array([f.turns for f in frames])).astype(np.float32)
        noses = origins[:, -1]
        before = np.vstack([noses[0] if self._nose is None else self._nose, noses[:-1]])
        self._nose = noses[-1]
        self._put(ARM, times, self._rerun.LineStrips3D.columns(strips=origins))
        self._put(NOSE_PATH, times, self._rerun.LineStrips3D.columns(strips=np.stack([before, noses], axis=1)))

    def _noses(self, times: Array, places: list[Array]) -> None:
        self._put(NOSE_BELIEVED, times, self._rerun.Points3D.columns(positions=np.array(places)))

    def _belief(self, times: Array, scenes: list[BeliefScene]) -> None:
        self._put(SPHERES, times, self._ellipsoids(range_spheres(scenes)))
        self._put(HYPOTHESES, times, self._ellipsoids(hypotheses(scenes)))

    def _ellipsoids(self, bodies: Bodies) -> Any:
        centres, half_m, turns, lengths = bodies
        return self._rerun.Ellipsoids3D.columns(centers=centres, half_sizes=half_m, quaternions=turns).partition(lengths)

    def _sources(self, times: Array, places: list[Array]) -> None:
        """The true source; NaN: there is none."""
        is_open = np.isfinite(places).all(axis=1)
        self._put(SOURCE, times, self._rerun.Points3D.columns(positions=np.array(places)[is_open]).partition(is_open.astype(int)))

    def _lines(self, times: Array, lines: list[tuple[str, str]]) -> None:
        texts, levels = zip(*lines, strict=True)
        self._put(LINES, times, self._rerun.TextLog.columns(text=texts, level=levels))

    def _verdict(self, times: Array, texts: list[str]) -> None:
        self._put(VERDICT, times, self._rerun.TextDocument.columns(text=texts))

    def _put(self, path: str, times: Array, columns: Any) -> None:
        at = [self._rerun.TimeColumn(TIMELINE, duration=times.astype("timedelta64[ns]"))]
        if self._began_ns is not None:
            at.append(self._rerun.TimeColumn(TIME_OF_DAY, timestamp=(times + self._began_ns).astype("datetime64[ns]")))
        self._recording.send_columns(path, indexes=at, columns=columns)
