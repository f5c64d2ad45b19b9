"""Framing: resynchronising decoders for a byte stream that may begin anywhere, be cut anywhere and contain noise.

Two kinds of wire: `Sized` frames give their length after their head, `Marked` frames end in a delimiter that cannot occur within them.
Both count `good` frames, `corrupt` ones (that failed their checksum or never ended) and `skipped` bytes, which belonged to no good frame.
Neither buffers more than the longest frame and what was just fed, and neither raises, whatever the bytes.
"""

import re
from abc import ABC, abstractmethod
from typing import ClassVar, Generic, TypeVar

F = TypeVar("F")


class Framer(ABC, Generic[F]):
    """Base class of both kinds: the counters and the buffer of an incomplete frame."""

    def __init__(self) -> None:
        self.good = 0
        self.corrupt = 0
        self.skipped = 0
        self._held = b""

    @property
    def held(self) -> int:
        """Number of buffered bytes."""
        return len(self._held)

    @abstractmethod
    def _frame(self, raw: bytes) -> F | None:
        """Decode a frame; None if it fails its checksum."""


class Sized(Framer[F]):
    """Decoder of frames whose head gives their length.

    Searches head by head, from the left: a frame that fails its checksum gives up its first byte only, so a false head never swallows a
    frame behind it. It can delay that frame, until the false head's length has come or `quiet` is called.
    """

    head: re.Pattern[bytes]  # matches `width` bytes and no other number
    width: ClassVar[int]

    def __init__(self) -> None:
        super().__init__()
        self._failed_until = 0  # buffered bytes claimed by a failed frame: heads within them are its payload, not further corrupt frames

    def feed(self, data: bytes) -> list[F]:
        """Return the frames that these bytes complete, oldest first."""
        self._held += data
        return self._decode(flush=False)

    def flush(self) -> list[F]:
        """Flush after the line has fallen silent: no buffered frame will be completed. Returns the good frames behind a false head."""
        return self._decode(flush=True)

    @abstractmethod
    def _size(self, head: bytes) -> int:
        """Number of bytes of the whole frame, head and checksum included; 0 if no frame begins so."""

    def _decode(self, flush: bool) -> list[F]:
        frames: list[F] = []
        at = framed = 0
        while match := self.head.search(self._held, at):
            at, size = match.start(), self._size(match[0])
            if not flush and at + size > len(self._held):
                break
            if size and (frame := self._counted_frame(at, size)) is not None:
                frames.append(frame)
                at, framed = at + size, framed + size
            else:
                at += 1
        else:  # no head is left, but the last bytes may be the beginning of one
            at = len(self._held) if flush else max(at, len(self._held) - self.width + 1)
        self.skipped += at - framed
        self._held, self._failed_until = self._held[at:], max(0, self._failed_until - at)
        return frames

    def _counted_frame(self, at: int, size: int) -> F | None:
        end = at + size
        frame = self._frame(self._held[at:end]) if end <= len(self._held) else None
        if frame is not None:
            self.good += 1
        elif at >= self._failed_until:
            self.corrupt += 1
            self._failed_until = end
        return frame


class Marked(Framer[F]):
    """Decoder of frames that end in a delimiter which cannot occur within them: each is found at once, whatever surrounds it.

    Delimiters are not counted as skipped.
    """

    mark: ClassVar[bytes]
    longest: ClassVar[int]  # bytes of a frame without its delimiter

    def feed(self, data: bytes) -> list[F]:
        """Return the frames that these bytes complete, oldest first."""
        *ended, rest = (self._held + data).split(self.mark)
        frames = [frame for each in ended if (raw := self._frame_start(each)) and (frame := self._counted_frame(raw)) is not None]
        start = self._frame_start(rest)
        self._held = start[: self.longest + 1]  # one byte over the limit marks an overlong frame, whose end must not be taken for one
        self.skipped += len(start) - len(self._held)
        return frames

    def flush(self) -> list[F]:
        """Flush after the line has fallen silent: what is buffered will not be completed."""
        if self._held:
            self._count_corrupt(self._held)
        self._held = b""
        return []

    def _frame_start(self, raw: bytes) -> bytes:
        """Return the part of these bytes that can be (the beginning of) a frame; the others are counted as skipped."""
        return raw

    def _counted_frame(self, raw: bytes) -> F | None:
        frame = self._frame(raw) if len(raw) <= self.longest else None
        if frame is not None:
            self.good += 1
        else:
            self._count_corrupt(raw)
        return frame

    def _count_corrupt(self, raw: bytes) -> None:
        self.skipped += len(raw)
        self.corrupt += 1
