"""A device and the thread that talks with it: opened, set up, asked again and again, and opened anew with back-off when it went away."""

import threading
from collections import Counter
from typing import Protocol

from hardware.transport.clock import Clock
from hardware.transport.discovery import resolve_port
from hardware.transport.mailbox import Mailbox
from hardware.transport.port import DeviceLost, NoAnswer, Unplugged, Wire, open_port
from oio.core.errors import OioError
from oio.core.records import nanoseconds, seconds
from oio.core.settings import in_range, settings

Counts = Counter[str]


@settings
class Patience:
    """How long a device may keep quiet, and how long it may stay away."""

    first_s: float  # to its first answer, when the world opens
    silent_s: float  # without an answer: then the port is opened anew
    away_s: float  # then the run ends
    backoff_s: float  # before the first new try; twice as long before each further one,
    backoff_most_s: float  # but so long at most

    def check(self) -> None:
        """Refuse to wait for ever, or not at all."""
        in_range(self, first_s=(0.1, 600), silent_s=(0.05, 600), away_s=(0, 3600), backoff_s=(0.01, 10), backoff_most_s=(0.01, 60))


class Driver(Protocol):
    """What speaks one device's language. Everything raises Unplugged when the port is gone, NoAnswer when the device is silent."""

    key: str  # of the configuration: backend.nose
    name: str  # as typed after KEY.driver=
    baud: int

    def knock(self, wire: Wire) -> str | None:
        """Who answers, if it is such a device; None if not."""
        ...

    def begin(self, wire: Wire) -> None:
        """Set the device up. Called each time the port was opened."""
        ...

    def turn(self, wire: Wire) -> bool:
        """One round, which leaves samples in the mailbox; whether the device said anything."""
        ...

    def end(self, wire: Wire) -> None:
        """Leave the device as it should be left."""
        ...

    def counts(self) -> Counts:
        """Frames so far: good, corrupt, skipped (bytes), lost, late, and what else the driver tells."""
        ...


class Device(threading.Thread):
    """The thread. `error` is why it ended, if it did so by itself; `news` are (kind, text) for the log."""

    def __init__(self, port: str, driver: Driver, mailbox: Mailbox, clock: Clock, patience: Patience) -> None:
        super().__init__(name=f"oio {driver.key}", daemon=True)
        self._port, self.driver, self._mailbox, self._clock, self._patience = port, driver, mailbox, clock, patience
        self.news: list[tuple[str, str]] = []
        self.error: BaseException | None = None
        self.reconnects = 0
        self.away_ns = 0  # all the time without a word from it, since its first
        self._heard_ns = 0
        self._wire: Wire | None = None
        self.lost = False  # until it says something again
        self._leave, self.ready = threading.Event(), threading.Event()

    def run(self) -> None:
        """Until `leave`, or until the device stayed away too long."""
        try:
            self._lasting(self._patience.first_s)
            self._heard_ns = self._clock.now_ns()
            while not self._leave.is_set():
                why = self._talk()
                if why and not self._leave.is_set():
                    self._lose(why)
                    self._lasting(self._patience.away_s)
        except BaseException as error:  # nothing dies unseen in a thread: the world raises it
            self.error = error
        finally:
            self._say_goodbye()
            self._close()
            self.ready.set()
            self._mailbox.wake()

    def leave(self) -> None:
        """Ask it to end, and wait."""
        self._leave.set()
        if self.is_alive():  # one whose turn to start never came has nothing to end
            self.join(timeout=10.0)

    def _lasting(self, patience_s: float) -> None:
        """Open the port, again and again for so long. Raises Gone."""
        began_ns, wait_s, why = self._clock.now_ns(), self._patience.backoff_s, "unplugged"
        while not self._leave.is_set():
            try:
                self._open()
                self.ready.set()
                return
            except (Unplugged, NoAnswer) as error:
                why = str(error) or why
                self._close()
            if self._clock.now_ns() - began_ns > nanoseconds(patience_s):
                raise DeviceLost(self._complaint(why, patience_s))
            self._leave.wait(self._clock.host_s(wait_s))
            wait_s = min(2.0 * wait_s, self._patience.backoff_most_s)

    def _open(self) -> None:
        key = f"{self.driver.key}.port"
        try:
            path = resolve_port(self._port, key, self.driver.baud, self.driver.knock)
        except OioError:
            if not self.ready.is_set():
                raise  # it was never there: a person must act
            raise Unplugged("the port is not there") from None
        try:
            self._wire = open_port(path, self.driver.baud, key)
        except OioError:
            if not self.ready.is_set():
                raise
            raise Unplugged("the port may not be opened") from None
        self.driver.begin(self._wire)

    def _talk(self) -> str:
        """Rounds, until the port is gone or the device has been silent for too long: why. Raises Gone if it does not help to open it."""
        assert self._wire is not None
        opened_ns, why = self._clock.now_ns(), "silent"
        while not self._leave.is_set():
            try:
                if self.driver.turn(self._wire):
                    self._hear()
            except NoAnswer as error:
                why = str(error) or why  # the driver counts it; silence that lasts ends below
            except Unplugged as error:
                return str(error) or "unplugged"
            now_ns = self._clock.now_ns()
            if now_ns - self._heard_ns > nanoseconds(self._patience.away_s + self._patience.silent_s):
                raise DeviceLost(self._complaint(why, self._patience.away_s))
            if now_ns - max(self._heard_ns, opened_ns) > nanoseconds(self._patience.silent_s):
                return why
        return ""

    def _hear(self) -> None:
        silent_ns = self._clock.now_ns() - self._heard_ns
        self._heard_ns += silent_ns
        if self.lost:
            self.lost = False
            self.away_ns += silent_ns
            self.news.append(("gap", f"{self.driver.key} {self.driver.name}: back after {seconds(silent_ns):.1f} s"))

    def _say_goodbye(self) -> None:
        try:
            if self._wire is not None:
                self.driver.end(self._wire)
        except (Unplugged, NoAnswer):
            pass  # it is gone already: there is nobody to say goodbye to

    def _lose(self, why: str) -> None:
        self.reconnects += 1
        self.lost = True
        self.news.append(("gap", f"{self.driver.key} {self.driver.name}: {why}; its port is opened anew"))
        self._close()

    def _close(self) -> None:
        if self._wire is not None:
            self._wire.close()
            self._wire = None

    def _complaint(self, why: str, patience_s: float) -> str:
        key = self.driver.key
        return (
            f"{key}.driver={self.driver.name} at {key}.port={self._port} did not answer for {patience_s:g} s ({why}). Check cable, power "
            f"and driver; `python -m hardware.ports` asks every port who it is."
        )
