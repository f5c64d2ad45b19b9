"""Who opens the gas: a person who is asked, two relays of a microcontroller (`V0`, `V1`, `V2`), or nobody."""

import contextlib
import math
import select
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from typing import Protocol

from hardware.links.asking import drained
from hardware.links.device import Patience
from hardware.links.find import found
from hardware.links.microcontroller import BAUD, BOOT_S, acknowledged
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
NAME = "backend.valve line"
BEAT_S = 1.0  # of the host, between two repetitions of the last command: the board closes the gas after 10 s without one
AGAIN_S = 0.2  # between two tries to open a port that went away
CLOSE_S = 1.0  # at the end, when nobody shall wait
JOIN_S = 10.0  # the longest that a beat may take: it may be opening ports


class Valve(Protocol):
    """Opens one source and closes the others."""

    def present(self, source: str) -> None:
        """When it returns, it is so. Raises OioError if it cannot be."""
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
            return Relays(self.port, patience)
        return Asked() if self.driver == "ask" else Nobody()


class Nobody:
    """Gas is as it is; the log says what was asked for."""

    def present(self, source: str) -> None:
        """Nothing."""

    def watch(self) -> None:
        """Nothing."""

    def leave(self) -> None:
        """Nothing."""


class Asked:
    """A person."""

    def __init__(self) -> None:
        self._open = "none"

    def present(self, source: str) -> None:
        """Ask, and wait for Enter. Raises OioError where nobody can be asked; KeyboardInterrupt after Ctrl-C."""
        self._open = source
        _say(f"please {SOURCES[source]}, then press Enter.")
        while not select.select([sys.stdin], [], [], 0.2)[0]:
            stopping.check()
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


class Relays:
    """A microcontroller with two outputs (hardware/firmware/nose has them). A thread tells it again and again that we are alive."""

    def __init__(self, port: str, patience: Patience) -> None:
        self._port, self._patience, self._lines = port, patience, line.Lines()
        self._wire: Wire | None = None
        self._told, self._away_s = "V0", math.nan  # the last command; since when the port has been away [s of the host]
        self._news, self._error = deque[str](), list[BaseException]()
        self._lock, self._leave = threading.Lock(), threading.Event()  # of all above but the news
        self._heart = threading.Thread(target=self._beats, name=NAME, daemon=True)
        try:
            self._knock(self._opened(), patience.first_s)  # the opening has reset it
        except (NoAnswer, Unplugged) as error:
            self._close()
            raise self._complaint("says nothing", error) from None
        self._heart.start()

    def present(self, source: str) -> None:
        """Told until it says that it did, and again when its port has come back."""
        while not self._lock.acquire(timeout=AGAIN_S):  # a beat may be opening ports
            stopping.check()
        try:
            self._tell(source, self._patience.away_s, stopping.check)
        except BaseException:
            self._told = "V0"  # or the next beat would open it after all
            raise
        finally:
            self._lock.release()

    def watch(self) -> str | None:
        """The oldest news of the thread, which mends what it can; raises what ended it, or that the port stays away."""
        if self._news:
            return self._news.popleft()
        if self._error:
            raise self._error[0]
        if time.monotonic() - self._away_s > self._patience.away_s:
            raise self._complaint("stays away", NoAnswer("no answer"))
        return None

    def leave(self) -> None:
        """Close both and let the port go."""
        self._leave.set()
        self._heart.join(JOIN_S)
        with contextlib.suppress(OioError):
            self._tell("none", CLOSE_S, lambda: None)
        self._close()

    def _beats(self) -> None:
        try:
            while not self._leave.wait(BEAT_S if math.isnan(self._away_s) else AGAIN_S):
                if self._lock.acquire(timeout=AGAIN_S):  # else `present` is telling it: that is a beat, too
                    try:
                        self._beat()
                    finally:
                        self._lock.release()
        except BaseException as error:  # nothing dies unseen in a thread: `watch` raises it
            self._error.append(error)

    def _beat(self) -> None:
        """A port that goes away takes the gas with it: the board begins anew when it is back. It is then told again, without waiting."""
        away = not math.isnan(self._away_s)
        try:
            wire = self._wire or self._opened()
            fields = drained(wire, self._lines)
            if away and any(each[:2] == ("ACK", self._told) for each in fields):
                self._away_s = math.nan
                self._news.append(f"{NAME}: did {self._told} again")
            wire.write(line.command(self._told))
        except (Unplugged, BadInput):  # BadInput: the port is not there
            self._close()
            if not away:
                self._away_s = time.monotonic()
                self._news.append(f"{NAME}: its port went away")

    def _tell(self, source: str, within_s: float, check: Callable[[], None]) -> None:
        self._told = command = f"V{list(SOURCES).index(source)}"
        until_s = time.monotonic() + within_s
        while True:
            check()
            try:
                acknowledged(self._wire or self._opened(), self._lines, command)
                self._away_s = math.nan
                return
            except (NoAnswer, Unplugged, BadInput) as error:  # BadInput: the port is away
                if not isinstance(error, NoAnswer):
                    self._close()
                    time.sleep(AGAIN_S)
                if time.monotonic() >= until_s:
                    raise self._complaint(f"does not say that it did {command}", error) from None

    def _complaint(self, what: str, error: Exception) -> OioError:
        return OioError(f"the valve at backend.valve.port={self._port} {what} ({error}). Check its cable and power.")

    def _opened(self) -> Wire:
        key = "backend.valve.port"
        path = found(self._port, key, BAUD, lambda wire: self._knock(wire, BOOT_S))
        self._wire = opened(path, BAUD, key)
        return self._wire

    def _knock(self, wire: Wire, within_s: float) -> str | None:
        return ", ".join(acknowledged(wire, self._lines, "ID", within_s)[2:])

    def _close(self) -> None:
        if self._wire is not None:
            self._wire.close()
            self._wire = None


def _say(text: str) -> None:
    print(f"oio: {text}", file=sys.stderr, flush=True)  # noqa: T201
