"""Two relays of a microcontroller (hardware/firmware/nose), told again and again that we are alive: else it closes the gas by itself."""

import contextlib
import math
import threading
import time
from collections import deque
from collections.abc import Callable

from hardware.codecs import line
from hardware.transport.clock import suspended_ns
from hardware.transport.device import Patience
from hardware.transport.discovery import resolve_port
from hardware.transport.microcontroller import BAUD, BOOT_S, acknowledged
from hardware.transport.port import NoAnswer, Unplugged, Wire, open_port
from hardware.transport.request import drain
from oio.core.errors import BadInput, OioError
from oio.core.records import seconds

COMMANDS = {"none": "V0", "beacon": "V1", "source": "V2"}
NAME = "backend.valve line"
HEARTBEAT_S = 1.0  # of the host, between two repetitions of the last command
NO_ANSWER_S = 3.5  # without an answer to any of them: its port is opened anew, which resets an Arduino
RETRY_S = 0.2  # between two tries to open a port that went away
CLOSE_S = 1.0  # at the end, when nobody shall wait
JOIN_S = 10.0  # the longest that a beat may take: it may be opening ports
HOLD_S = 10.0  # after so long without one the board closes the gas


class RelayValve:
    """Live until `leave`. Its port is opened once here: raises BadInput or OioError for what is not there or does not answer."""

    def __init__(self, port: str, patience: Patience) -> None:
        self._port, self._patience, self._lines = port, patience, line.Lines()
        self._wire: Wire | None = None
        self._told, self._away_s = COMMANDS["none"], math.nan  # the last command; since when the port has been away [s of the host]
        self._beaten_s = _awake_or_not_s()
        self._answered_s = math.inf  # when it last said that it did as it was told [s of the host]
        self._news, self._error = deque[str](), list[BaseException]()
        self._lock, self._leave = threading.Lock(), threading.Event()  # of all above but the news
        self._heart = threading.Thread(target=self._beats, name=NAME, daemon=True)
        try:
            self._knock(self._opened(), patience.first_s)  # the opening has reset it
        except (NoAnswer, Unplugged) as error:
            self._close()
            raise self._complaint("says nothing", error) from None
        self._heart.start()

    def present(self, source: str, check: Callable[[], None]) -> None:
        """Told until it says that it did, and again when its port has come back."""
        while not self._lock.acquire(timeout=RETRY_S):  # a beat may be opening ports
            check()
        try:
            self._tell(source, self._patience.away_s, check)
        except BaseException:
            self._told = COMMANDS["none"]  # or the next beat would open it after all
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
            while not self._leave.wait(HEARTBEAT_S if math.isnan(self._away_s) else RETRY_S):
                if self._lock.acquire(timeout=RETRY_S):  # else `present` is telling it: that is a beat, too
                    try:
                        self._beat()
                    finally:
                        self._lock.release()
        except BaseException as error:  # nothing dies unseen in a thread: `watch` raises it
            self._error.append(error)

    def _beat(self) -> None:
        """A port that goes away takes the gas with it: the board begins anew when it is back. It is then told again, without waiting."""
        away, now_s = not math.isnan(self._away_s), _awake_or_not_s()
        silent_s, self._beaten_s = now_s - self._beaten_s, now_s
        if silent_s > HOLD_S and self._told != COMMANDS["none"]:
            self._told = COMMANDS["none"]  # the board has closed the gas long ago, and nobody expects it to open it now
            raise OioError(f"the computer was suspended or too busy for {silent_s:.0f} s, in which the valve closed the gas by itself.")
        try:
            wire = self._wire or self._opened()
            if any(each[:2] == ("ACK", self._told) for each in drain(wire, self._lines)):
                self._answered_s = now_s
                if away:
                    self._away_s = math.nan
                    self._news.append(f"{NAME}: did {self._told} again")
            elif not away and now_s - self._answered_s > NO_ANSWER_S:
                self._lose("does not answer")
                return
            wire.write(line.command(self._told))
        except (Unplugged, BadInput):  # BadInput: the port is not there
            if away:
                self._close()
            else:
                self._lose("its port went away")

    def _lose(self, why: str) -> None:
        self._close()
        self._away_s = time.monotonic()
        self._news.append(f"{NAME}: {why}")

    def _tell(self, source: str, within_s: float, check: Callable[[], None]) -> None:
        self._told = command = COMMANDS[source]
        until_s = time.monotonic() + within_s
        while True:
            check()
            try:
                acknowledged(self._wire or self._opened(), self._lines, command)
                self._away_s, self._beaten_s, self._answered_s = math.nan, _awake_or_not_s(), _awake_or_not_s()
                return
            except (NoAnswer, Unplugged, BadInput) as error:  # BadInput: the port is away
                if not isinstance(error, NoAnswer):
                    self._close()
                    time.sleep(RETRY_S)
                if time.monotonic() >= until_s:
                    raise self._complaint(f"does not say that it did {command}", error) from None

    def _complaint(self, what: str, error: Exception) -> OioError:
        return OioError(f"the valve at backend.valve.port={self._port} {what} ({error}). Check its cable and power.")

    def _opened(self) -> Wire:
        key = "backend.valve.port"
        path = resolve_port(self._port, key, BAUD, lambda wire: self._knock(wire, BOOT_S))
        self._wire = open_port(path, BAUD, key)
        return self._wire

    def _knock(self, wire: Wire, within_s: float) -> str | None:
        return ", ".join(acknowledged(wire, self._lines, "ID", within_s)[2:])

    def _close(self) -> None:
        if self._wire is not None:
            self._wire.close()
            self._wire = None


def _awake_or_not_s() -> float:
    """Of the host, the time in which it was suspended included."""
    return time.monotonic() + seconds(suspended_ns())
