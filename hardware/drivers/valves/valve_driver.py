"""Relay valve driver (hardware/firmware/nose) with a heartbeat: without it the board closes the gas by itself."""

import contextlib
import math
import threading
import time
from collections import deque
from collections.abc import Callable

from hardware.codecs import line
from hardware.transport.clock import suspended_ns
from hardware.transport.discovery import resolve_port
from hardware.transport.driver import Timeouts
from hardware.transport.microcontroller import BAUD, BOOT_S, acknowledged
from hardware.transport.port import NoAnswer, Unplugged, Wire, open_port
from hardware.transport.request import drain
from oio.core.errors import BadInput, OioError
from oio.core.records import seconds

COMMANDS = {"none": "V0", "beacon": "V1", "source": "V2"}
NAME = "backend.valve line"
HEARTBEAT_S = 1.0  # period of the heartbeat [host s], which repeats the last command
NO_ANSWER_S = 3.5  # time-out of the acknowledgement: then the port is reopened, which resets an Arduino
RETRY_S = 0.2  # between two attempts to reopen the port
CLOSE_S = 1.0  # time-out of the final close command
JOIN_S = 10.0  # longest duration of one heartbeat, which may open ports
HOLD_S = 10.0  # the board closes the gas after this time without a heartbeat


class RelayValve:
    """Two relays of a microcontroller, live until `close`. The constructor opens the port: raises BadInput or OioError on failure."""

    def __init__(self, port: str, timeouts: Timeouts) -> None:
        self._port, self._timeouts, self._lines = port, timeouts, line.Lines()
        self._wire: Wire | None = None
        self._command, self._away_s = COMMANDS["none"], math.nan  # last command; time since which the port has been away [host s]
        self._last_heartbeat_s = _host_s()
        self._acknowledged_s = math.inf  # time of the last acknowledgement [host s]
        self._events, self._error = deque[str](), list[BaseException]()
        self._lock, self._stop_requested = threading.Lock(), threading.Event()  # guards all of the above except the events
        self._heartbeat_thread = threading.Thread(target=self._run_heartbeats, name=NAME, daemon=True)
        try:
            self._identify(self._open(), timeouts.connect_s)  # opening the port has reset the board
        except (NoAnswer, Unplugged) as error:
            self._close_port()
            raise self._valve_error("says nothing", error) from None
        self._heartbeat_thread.start()

    def present(self, source: str, check: Callable[[], None]) -> None:
        """Send the command until it is acknowledged, also across a reconnection."""
        while not self._lock.acquire(timeout=RETRY_S):  # the heartbeat may be opening ports
            check()
        try:
            self._send(source, self._timeouts.reconnect_s, check)
        except BaseException:
            self._command = COMMANDS["none"]  # else the next heartbeat would open it nevertheless
            raise
        finally:
            self._lock.release()

    def poll(self) -> str | None:
        """Return the oldest event of the heartbeat thread, or None. Raises what ended that thread, or OioError after the time-out."""
        if self._events:
            return self._events.popleft()
        if self._error:
            raise self._error[0]
        if time.monotonic() - self._away_s > self._timeouts.reconnect_s:
            raise self._valve_error("stays away", NoAnswer("no answer"))
        return None

    def close(self) -> None:
        """Close both relays and the port."""
        self._stop_requested.set()
        self._heartbeat_thread.join(JOIN_S)
        with contextlib.suppress(OioError):
            self._send("none", CLOSE_S, lambda: None)
        self._close_port()

    def _run_heartbeats(self) -> None:
        try:
            while not self._stop_requested.wait(HEARTBEAT_S if math.isnan(self._away_s) else RETRY_S):
                if self._lock.acquire(timeout=RETRY_S):  # else `present` is sending the command, which counts as a heartbeat
                    try:
                        self._heartbeat()
                    finally:
                        self._lock.release()
        except BaseException as error:  # an exception in a thread is not reported by itself: `poll` raises it
            self._error.append(error)

    def _heartbeat(self) -> None:
        """Repeat the last command without waiting for its answer, so that a restarted board, which has closed the gas, gets it again."""
        away, now_s = not math.isnan(self._away_s), _host_s()
        silent_s, self._last_heartbeat_s = now_s - self._last_heartbeat_s, now_s
        if silent_s > HOLD_S and self._command != COMMANDS["none"]:
            self._command = COMMANDS["none"]  # the board has closed the gas long ago and must not reopen it now
            raise OioError(f"the computer was suspended or too busy for {silent_s:.0f} s, in which the valve closed the gas by itself.")
        try:
            wire = self._wire or self._open()
            if any(each[:2] == ("ACK", self._command) for each in drain(wire, self._lines)):
                self._acknowledged_s = now_s
                if away:
                    self._away_s = math.nan
                    self._events.append(f"{NAME}: did {self._command} again")
            elif not away and now_s - self._acknowledged_s > NO_ANSWER_S:
                self._disconnect("does not answer")
                return
            wire.write(line.command(self._command))
        except (Unplugged, BadInput):  # BadInput: the port is not there
            if away:
                self._close_port()
            else:
                self._disconnect("its port went away")

    def _disconnect(self, why: str) -> None:
        self._close_port()
        self._away_s = time.monotonic()
        self._events.append(f"{NAME}: {why}")

    def _send(self, source: str, within_s: float, check: Callable[[], None]) -> None:
        self._command = command = COMMANDS[source]
        until_s = time.monotonic() + within_s
        while True:
            check()
            try:
                acknowledged(self._wire or self._open(), self._lines, command)
                self._away_s, self._last_heartbeat_s, self._acknowledged_s = math.nan, _host_s(), _host_s()
                return
            except (NoAnswer, Unplugged, BadInput) as error:  # BadInput: the port is away
                if not isinstance(error, NoAnswer):
                    self._close_port()
                    time.sleep(RETRY_S)
                if time.monotonic() >= until_s:
                    raise self._valve_error(f"does not say that it did {command}", error) from None

    def _valve_error(self, what: str, error: Exception) -> OioError:
        return OioError(f"the valve at backend.valve.port={self._port} {what} ({error}). Check its cable and power.")

    def _open(self) -> Wire:
        key = "backend.valve.port"
        path = resolve_port(self._port, key, BAUD, lambda wire: self._identify(wire, BOOT_S))
        self._wire = open_port(path, BAUD, key)
        return self._wire

    def _identify(self, wire: Wire, within_s: float) -> str | None:
        return ", ".join(acknowledged(wire, self._lines, "ID", within_s)[2:])

    def _close_port(self) -> None:
        if self._wire is not None:
            self._wire.close()
            self._wire = None


def _host_s() -> float:
    """Host time including suspension [s]."""
    return time.monotonic() + seconds(suspended_ns())
