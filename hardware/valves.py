"""Who opens the gas: a person who is asked, two relays of a microcontroller (`V0`, `V1`, `V2`), or nobody."""

import contextlib
import select
import sys
from collections.abc import Iterator
from typing import Protocol

from hardware.links.asking import asked
from hardware.links.find import found
from hardware.links.port import NoAnswer, Unplugged, Wire, opened
from hardware.wire import line
from oio import stopping
from oio.errors import BadInput, OioError
from oio.settings import settings

DRIVERS = ("ask", "line", "none")
SOURCES = {
    "none": "close every gas source",
    "beacon": "open the beacon, the source whose place is known",
    "source": "open the source to be found",
}
ANSWER_S, TRIES = 0.5, 10
BAUD = 115_200


class Valve(Protocol):
    """Opens one source and closes the others."""

    def present(self, source: str) -> None:
        """When it returns, it is so. Raises OioError if it cannot be."""
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
    def open(self) -> Iterator[Valve]:
        """Ready to be told."""
        if self.driver != "line":
            yield Asked() if self.driver == "ask" else Nobody()
            return
        assert self.port is not None
        relays = Relays(self.port)
        try:
            yield relays
        finally:
            relays.close()


class Nobody:
    """Gas is as it is; the log says what was asked for."""

    def present(self, source: str) -> None:
        """Nothing."""


class Asked:
    """A person."""

    def present(self, source: str) -> None:
        """Ask, and wait for Enter. Raises OioError where nobody can be asked; KeyboardInterrupt after Ctrl-C."""
        print(f"oio: please {SOURCES[source]}, then press Enter.", file=sys.stderr, flush=True)  # noqa: T201
        while not select.select([sys.stdin], [], [], 0.2)[0]:
            stopping.check()
        if not sys.stdin.readline():
            raise OioError(
                f"nobody is there to {SOURCES[source]}: standard input has ended. Give backend.valve.driver=line with relays, or "
                f"backend.valve.driver=none if gas is as it is."
            )


class Relays:
    """A microcontroller with two outputs (hardware/firmware/nose has them)."""

    def __init__(self, port: str) -> None:
        self._port, self._lines, self._wire = port, line.Lines(), None
        self._open()

    _wire: Wire | None

    def present(self, source: str) -> None:
        """Told until it says that it did."""
        command = f"V{list(SOURCES).index(source)}"
        for _ in range(TRIES):
            stopping.check()
            try:
                wire = self._wire or self._open()
                asked(wire, f"{command}\n".encode(), self._lines, lambda f: f[:2] == ("ACK", command), ANSWER_S)
            except (NoAnswer, Unplugged) as error:
                if isinstance(error, Unplugged):
                    self.close()
                continue
            return
        raise OioError(f"the valve at backend.valve.port={self._port} does not say that it did {command}. Check its cable and power.")

    def close(self) -> None:
        """Let the port go; the valve stays as it is."""
        if self._wire is not None:
            self._wire.close()
            self._wire = None

    def _open(self) -> Wire:
        key = "backend.valve.port"
        try:
            self._wire = opened(found(self._port, key, BAUD, self._knock), BAUD, key)
        except Unplugged as error:
            raise OioError(f"{key}={self._port} cannot be opened: {error}.") from None
        return self._wire

    def _knock(self, wire: Wire) -> str | None:
        try:
            return ", ".join(asked(wire, b"ID\n", self._lines, lambda f: f[:2] == ("ACK", "ID"), ANSWER_S)[2:])
        except NoAnswer:
            return None
