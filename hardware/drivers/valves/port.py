"""Gas valve protocol and its configuration: a prompted operator, two relays of a microcontroller (`V0`, `V1`, `V2`), or no valve."""

import contextlib
import select
import sys
from collections.abc import Callable, Iterator
from typing import Protocol

from hardware.drivers.valves.valve_driver import RelayValve
from hardware.transport.driver import Timeouts
from oio.core.errors import BadInput, OioError
from oio.core.settings import settings

DRIVERS = ("ask", "line", "none")
SOURCES = {
    "none": "close every gas source",
    "beacon": "open the beacon, the source whose place is known",
    "source": "open the source to be found",
}


class Valve(Protocol):
    """Protocol of a gas valve, which opens one source and closes the others."""

    def present(self, source: str, check: Callable[[], None]) -> None:
        """Switch to a source; returns when done. Calls `check` while it waits. Raises OioError on failure, and what `check` raises."""
        ...

    def poll(self) -> str | None:
        """Return a fault or recovery since the last call, for the log, or None. Raises OioError when the valve is lost for good."""
        ...

    def close(self) -> None:
        """Close every source at the end of the run, if possible. Never raises OioError."""
        ...


@settings
class ValvePort:
    """Port of the gas valve."""

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
    def open(self, timeouts: Timeouts) -> Iterator[Valve]:
        """Open the valve driver. Raises BadInput or OioError for relays that are missing or do not answer."""
        valve = self._create(timeouts)
        try:
            yield valve
        finally:
            valve.close()

    def _create(self, timeouts: Timeouts) -> Valve:
        if self.driver == "line":
            assert self.port is not None
            return RelayValve(self.port, timeouts)
        return PromptedValve() if self.driver == "ask" else NoValve()


class NoValve:
    """Driver without a valve: the gas is not switched; the log records what was asked for."""

    def present(self, source: str, check: Callable[[], None]) -> None:
        """Do nothing."""

    def poll(self) -> None:
        """Do nothing."""

    def close(self) -> None:
        """Do nothing."""


class PromptedValve:
    """Valve switched by an operator on request."""

    def __init__(self) -> None:
        self._open = "none"

    def present(self, source: str, check: Callable[[], None]) -> None:
        """Prompt the operator and wait for Enter. Raises OioError at the end of standard input."""
        self._open = source
        _prompt(f"please {SOURCES[source]}, then press Enter.")
        while not select.select([sys.stdin], [], [], 0.2)[0]:
            check()
        if not sys.stdin.readline():
            raise OioError(
                f"nobody is there to {SOURCES[source]}: standard input has ended. Give backend.valve.driver=line with relays, or "
                f"backend.valve.driver=none if gas is as it is."
            )

    def poll(self) -> None:
        """Do nothing: the operator is not monitored."""

    def close(self) -> None:
        """Prompt the operator to close the gas, without waiting."""
        if self._open != "none":
            _prompt(f"please {SOURCES['none']}.")


def _prompt(text: str) -> None:
    print(f"oio: {text}", file=sys.stderr, flush=True)  # noqa: T201
