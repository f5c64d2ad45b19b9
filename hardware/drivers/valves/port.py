"""Who opens the gas: a person who is asked, two relays of a microcontroller (`V0`, `V1`, `V2`), or nobody."""

import contextlib
import select
import sys
from collections.abc import Callable, Iterator
from typing import Protocol

from hardware.drivers.valves.valve_driver import RelayValve
from hardware.transport.device import Patience
from oio.core.errors import BadInput, OioError
from oio.core.settings import settings

DRIVERS = ("ask", "line", "none")
SOURCES = {
    "none": "close every gas source",
    "beacon": "open the beacon, the source whose place is known",
    "source": "open the source to be found",
}


class Valve(Protocol):
    """Opens one source and closes the others."""

    def present(self, source: str, check: Callable[[], None]) -> None:
        """When it returns, it is so. Raises OioError if it cannot be, and what `check` raises, which is called while it waits."""
        ...

    def watch(self) -> str | None:
        """Called again and again meanwhile: what went wrong or was mended, for the log. Raises OioError when it is gone for good."""
        ...

    def leave(self) -> None:
        """The run is over: no gas is let out any more, if that can be. Never raises OioError."""
        ...


@settings
class ValvePort:
    """How sources are opened."""

    driver: str
    port: str | None

    def check(self) -> None:
        """Refuse unknown drivers and relays without a port."""
        if self.driver not in DRIVERS:
            raise BadInput(
                f"backend.valve.driver={self.driver} was given, but it can be {', '.join(DRIVERS)}. Type backend.valve.driver=ask."
            )
        if self.driver == "line" and self.port is None:
            raise BadInput("backend.valve.driver=line has no port. Type backend.valve.port=/dev/ttyUSB1, or backend.valve.driver=ask.")

    @contextlib.contextmanager
    def open(self, patience: Patience) -> Iterator[Valve]:
        """Ready to be told. Raises BadInput or OioError for relays that are not there or do not answer."""
        valve = self._made(patience)
        try:
            yield valve
        finally:
            valve.leave()

    def _made(self, patience: Patience) -> Valve:
        if self.driver == "line":
            assert self.port is not None
            return RelayValve(self.port, patience)
        return PromptedValve() if self.driver == "ask" else NoValve()


class NoValve:
    """Gas is as it is; the log says what was asked for."""

    def present(self, source: str, check: Callable[[], None]) -> None:
        """Nothing."""

    def watch(self) -> None:
        """Nothing."""

    def leave(self) -> None:
        """Nothing."""


class PromptedValve:
    """A person."""

    def __init__(self) -> None:
        self._open = "none"

    def present(self, source: str, check: Callable[[], None]) -> None:
        """Ask, and wait for Enter. Raises OioError where nobody can be asked."""
        self._open = source
        _say(f"please {SOURCES[source]}, then press Enter.")
        while not select.select([sys.stdin], [], [], 0.2)[0]:
            check()
        if not sys.stdin.readline():
            raise OioError(
                f"nobody is there to {SOURCES[source]}: standard input has ended. Give backend.valve.driver=line with relays, or "
                f"backend.valve.driver=none if gas is as it is."
            )

    def watch(self) -> None:
        """A person is trusted."""

    def leave(self) -> None:
        """Ask, and do not wait."""
        if self._open != "none":
            _say(f"please {SOURCES['none']}.")


def _say(text: str) -> None:
    print(f"oio: {text}", file=sys.stderr, flush=True)  # noqa: T201
