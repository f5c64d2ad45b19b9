"""Device thread: opens the port, configures the device, polls it, and reconnects with exponential back-off after it was lost."""

import threading
from typing import Generic

from hardware.transport.clock import Clock
from hardware.transport.driver import C, Driver, Timeouts
from hardware.transport.mailbox import Mailbox
from hardware.transport.opener import Opener
from hardware.transport.port import DeviceLost, NoAnswer, Unplugged
from oio.core.errors import OioError
from oio.core.records import nanoseconds, seconds

HUNG_JOIN_S = 1.0  # a call that did not return for long is not waited for at the end


class Device(threading.Thread, Generic[C]):
    """Communication thread of one device. `error` is the exception that ended it, if one did; `news` are (kind, text) for the log."""

    def __init__(self, opener: Opener[C], driver: Driver[C], mailbox: Mailbox, clock: Clock, timeouts: Timeouts) -> None:
        super().__init__(name=f"oio {driver.key}", daemon=True)
        self._opener, self.driver, self._mailbox, self._clock, self._timeouts = opener, driver, mailbox, clock, timeouts
        self.news: list[tuple[str, str]] = []
        self.error: BaseException | None = None
        self.identity: str | None = None  # what the device said of itself when its port was last opened
        self.reconnects = 0
        self.away_ns = 0  # total time without an answer, of all lost connections
        self._last_answer_ns = 0
        self._connection: C | None = None
        self.lost = False  # from a lost connection until the next answer
        self._stop_requested, self.ready = threading.Event(), threading.Event()

    def run(self) -> None:
        """Poll until `stop` is called or the device has been away for too long."""
        try:
            self._open_with_back_off(self._timeouts.connect_s)
            self._last_answer_ns = self._clock.now_ns()
            while not self._stop_requested.is_set():
                why = self._poll_until_lost()
                if why and not self._stop_requested.is_set():
                    self._disconnect(why)
                    self._open_with_back_off(self._timeouts.reconnect_s)
        except BaseException as error:  # an exception in a thread is not reported by itself: the world raises it
            self.error = error
        finally:
            self._release()
            self._close()
            self.ready.set()
            self._mailbox.wake()

    def stop(self) -> None:
        """Request the end of the thread and wait for it."""
        self._stop_requested.set()
        if self.is_alive():  # a thread that was never started cannot be joined
            self.join(timeout=HUNG_JOIN_S if self._hangs else 10.0)

    def check(self) -> None:
        """Raise what ended the thread, or DeviceLost for a call into the device that does not return."""
        if self.error is not None:
            raise self.error
        if self._hangs:
            raise self._lost(f"hangs: a call has not returned for {self._opener.call_s:.1f} s; what it was given last is where it stands")

    @property
    def _hangs(self) -> bool:
        """Whether a call lasts longer than any may."""
        most, is_open = self._timeouts, self.ready.is_set()
        return self._opener.call_s > (most.receive_s + most.reconnect_s if is_open else most.connect_s)

    def _open_with_back_off(self, patience_s: float) -> None:
        """Open the port, with retries and exponential back-off for at most patience_s. Raises DeviceLost."""
        start_ns, wait_s, why = self._clock.now_ns(), self._timeouts.backoff_s, "unplugged"
        while not self._stop_requested.is_set():
            try:
                self._open()
                self.ready.set()
                return
            except (Unplugged, NoAnswer) as error:
                why = str(error) or why
                self._close()
            if self._clock.now_ns() - start_ns > nanoseconds(patience_s):
                raise self._silent(why, patience_s)
            self._stop_requested.wait(self._clock.host_s(wait_s))
            wait_s = min(2.0 * wait_s, self._timeouts.backoff_max_s)

    def _open(self) -> None:
        try:
            self._connection = self._opener.open()
        except OioError as error:
            if not self.ready.is_set():
                raise  # it never was there: the user must act
            raise Unplugged(str(error).partition(". ")[0]) from None
        self.identity = self.driver.configure(self._connection)

    def _poll_until_lost(self) -> str:
        """Poll until the port is gone or the device times out; return the reason. Raises DeviceLost if reopening has not helped."""
        assert self._connection is not None
        opened_ns, why = self._clock.now_ns(), "silent"
        while not self._stop_requested.is_set():
            try:
                if self.driver.poll(self._connection):
                    self._note_answer()
            except NoAnswer as error:
                why = str(error) or why  # counted by the driver; a lasting silence is handled below
            except Unplugged as error:
                return str(error) or "unplugged"
            now_ns = self._clock.now_ns()
            if now_ns - self._last_answer_ns > nanoseconds(self._timeouts.reconnect_s + self._timeouts.receive_s):
                raise self._silent(why, self._timeouts.reconnect_s)
            if now_ns - max(self._last_answer_ns, opened_ns) > nanoseconds(self._timeouts.receive_s):
                return why
        return ""

    def _note_answer(self) -> None:
        silent_ns = self._clock.now_ns() - self._last_answer_ns
        self._last_answer_ns += silent_ns
        if self.lost:
            self.lost = False
            self.away_ns += silent_ns
            self.news.append(("gap", f"{self.driver.key} {self.driver.name}: back after {seconds(silent_ns):.1f} s"))

    def _release(self) -> None:
        try:
            if self._connection is not None:
                self.driver.release(self._connection)
        except (Unplugged, NoAnswer):
            pass  # the device is gone already: there is nothing to release

    def _disconnect(self, why: str) -> None:
        self.reconnects += 1
        self.lost = True
        self.news.append(("gap", f"{self.driver.key} {self.driver.name}: {why}; its port is opened anew"))
        self._close()

    def _close(self) -> None:
        if self._connection is not None:
            self._connection.close()
            self._connection = None

    def _lost(self, what: str) -> DeviceLost:
        key, opener = self.driver.key, self._opener
        return DeviceLost(f"{key}.driver={self.driver.name} at {key}.port={opener.port} {what}. {opener.advice}")

    def _silent(self, why: str, patience_s: float) -> DeviceLost:
        return self._lost(f"did not answer for {patience_s:g} s ({why})")
