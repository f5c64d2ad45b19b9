"""Watch over calls into code of others, which has no time-out: how long the present one has lasted."""

import contextlib
from collections.abc import Iterator

from hardware.transport.clock import Clock
from oio.core.records import seconds


class CallWatch:
    """The thread that calls says when; any other thread asks."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._since_ns: int | None = None  # None between two calls

    @contextlib.contextmanager
    def call(self) -> Iterator[None]:
        """The block is a call."""
        self._since_ns = self._clock.now_ns()
        try:
            yield
        finally:
            self._since_ns = None

    @property
    def lasts_s(self) -> float:
        """Duration of the present call [s]; 0 between two."""
        since_ns = self._since_ns
        return 0.0 if since_ns is None else seconds(self._clock.now_ns() - since_ns)
