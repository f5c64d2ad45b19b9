"""Finds frames in a stream of bytes that may begin anywhere, be cut anywhere and hold anything in between.

Two kinds of wire: `Sized` frames say after their head how long they are, `Marked` frames end in a byte that nothing within them can be.
Both count `good` frames, `corrupt` ones (that failed their check or never ended) and `skipped` bytes, which belonged to no good frame.
Neither holds more than the longest frame and what was just fed, and no bytes whatever make them raise.
"""

import re
from typing import ClassVar, Generic, TypeVar

F = TypeVar("F")


class Framer(Generic[F]):
    """What both kinds share: the counters and the bytes that wait for their rest."""

    def __init__(self) -> None:
        self.good = 0
        self.corrupt = 0
        self.skipped = 0
        self._held = b""

    @property
    def held(self) -> int:
        """How many bytes wait for the rest of their frame."""
        return len(self._held)

    def _frame(self, raw: bytes) -> F | None:
        """The frame that these bytes are; None if they fail the check."""
        raise NotImplementedError


class Sized(Framer[F]):
    """Frames with a head that tells their length.

    Head by head, from the left: a frame that fails its check gives up its first byte alone, so a false head never swallows a frame
    behind it. It can delay that frame, until the false head's length has come or `quiet` is called.
    """

    head: re.Pattern[bytes]  # matches `width` bytes and no other number
    width: ClassVar[int]

    def __init__(self) -> None:
        super().__init__()
        self._blamed = 0  # bytes held that a failed frame claims: heads within it are its payload, not further corrupt frames

    def feed(self, data: bytes) -> list[F]:
        """The frames that these bytes complete, oldest first."""
        self._held += data
        return self._found(over=False)

    def quiet(self) -> list[F]:
        """The line has fallen silent: no frame held will be completed. Gives the good frames that waited behind a false head."""
        return self._found(over=True)

    def _size(self, head: bytes) -> int:
        """Bytes of the whole frame, its head and check included; 0 if no frame begins so."""
        raise NotImplementedError

    def _found(self, over: bool) -> list[F]:
        frames: list[F] = []
        at = framed = 0
        while match := self.head.search(self._held, at):
            at, size = match.start(), self._size(match[0])
            if not over and at + size > len(self._held):
                break
            if size and (frame := self._checked(at, size)) is not None:
                frames.append(frame)
                at, framed = at + size, framed + size
            else:
                at += 1
        else:  # no head is left, but the last bytes may begin one
            at = len(self._held) if over else max(at, len(self._held) - self.width + 1)
        self.skipped += at - framed
        self._held, self._blamed = self._held[at:], max(0, self._blamed - at)
        return frames

    def _checked(self, at: int, size: int) -> F | None:
        end = at + size
        frame = self._frame(self._held[at:end]) if end <= len(self._held) else None
        if frame is not None:
            self.good += 1
        elif at >= self._blamed:
            self.corrupt += 1
            self._blamed = end
        return frame


class Marked(Framer[F]):
    """Frames that end in a mark which cannot stand within them: each is found at once, whatever comes before or behind it.

    Marks are not counted as skipped.
    """

    mark: ClassVar[bytes]
    longest: ClassVar[int]  # bytes of a frame without its mark

    def feed(self, data: bytes) -> list[F]:
        """The frames that these bytes complete, oldest first."""
        *ended, rest = (self._held + data).split(self.mark)
        frames = [frame for each in ended if (raw := self._begun(each)) and (frame := self._checked(raw)) is not None]
        begun = self._begun(rest)
        self._held = begun[: self.longest + 1]  # one too many is kept, so that the end of something too long is not taken for a frame
        self.skipped += len(begun) - len(self._held)
        return frames

    def quiet(self) -> list[F]:
        """The line has fallen silent: what is held will not be completed."""
        if self._held:
            self._spoilt(self._held)
        self._held = b""
        return []

    def _begun(self, raw: bytes) -> bytes:
        """What of these bytes can be (the beginning of) a frame; the others are counted."""
        return raw

    def _checked(self, raw: bytes) -> F | None:
        frame = self._frame(raw) if len(raw) <= self.longest else None
        if frame is not None:
            self.good += 1
        else:
            self._spoilt(raw)
        return frame

    def _spoilt(self, raw: bytes) -> None:
        self.skipped += len(raw)
        self.corrupt += 1
