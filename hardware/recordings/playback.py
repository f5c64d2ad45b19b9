"""Playback of one part of a recording: its next row, and the offset of its clock to world time."""

import numpy as np

from hardware.recordings.recording_parts import Part
from oio.core.errors import BadInput
from oio.core.records import nanoseconds, seconds

NEVER_NS = 10**30  # later than every time stamp that a table accepts


class Playback:
    """Playback position in a part of a recording. It is paused while another part plays.

    Raises BadInput if the part holds no row; `label` names it.
    """

    def __init__(self, label: str, part: Part) -> None:
        self.part = part
        t_s = part.recorded.t_s
        self._row, stop = (int(i) for i in np.searchsorted(t_s, (part.from_s, part.until_s)))
        if self._row >= stop:
            raise BadInput(
                f"{label} needs rows from {part.from_s:g} to {part.until_s:g} s, but {part.recorded.name} ends at {t_s[-1]:g} s."
            )
        self._stamps_ns = [nanoseconds(t) for t in t_s[:stop].tolist()]
        self._from_ns = self._position_ns = nanoseconds(part.from_s)
        self._offset_ns = 0

    def resume(self, world_ns: int) -> None:
        """Resume at world time `world_ns`."""
        self._offset_ns = world_ns - self._position_ns

    def pause(self, world_ns: int) -> None:
        """Pause at world time `world_ns`."""
        self._position_ns = world_ns - self._offset_ns

    def advance(self) -> None:
        """Go to the next row."""
        self._row += 1

    def ppm(self, column: int) -> float:
        """Value of the next row [ppm]."""
        return float(self.part.recorded.ppm[self._row, column])

    @property
    def due_ns(self) -> int:
        """World time of the next row; NEVER_NS after the last."""
        return self._stamps_ns[self._row] + self._offset_ns if self._row < len(self._stamps_ns) else NEVER_NS

    @property
    def end_ns(self) -> int:
        """World time of the last row; nothing was recorded after it."""
        return self._stamps_ns[-1] + self._offset_ns

    @property
    def length_s(self) -> float:
        """Duration from the beginning of the part to its last row [s]."""
        return seconds(self._stamps_ns[-1] - self._from_ns)
