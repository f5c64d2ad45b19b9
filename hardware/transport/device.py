"""Device thread: opens the port, configures the device, polls it, and reconnects with exponential back-off after it was lost."""

import threading

from hardware.transport.clock import Clock
from hardware.transport.discovery import resolve_port
from hardware.transport.driver import Driver, Timeouts
from hardware.transport.mailbox import Mailbox
from hardware.transport.port import DeviceLost, NoAnswer, Unplugged, Wire, open_port
from oio.core.errors import OioError
from oio.core.records import nanoseconds, seconds


class Device(threading.Thread):
    """Communication thread of one device. `error` is the exception that ended it, if one did; `news` are (kind, text) for the log."""

    def __init__(self, port: str, driver: Driver, mailbox: Mailbox, clock: Clock, timeouts: Timeouts) -> None:
        super().__init__(name=f"oio {driver.key}", daemon=True)
        self._port, self.driver, self._mailbox, self._clock, self._timeouts = port, driver, mailbox, clock, timeouts
        self.news: list[tuple[str, str]] = []
        self.error: BaseException | None = None
        self.identity: str | None = None  # what the device said of itself when its port was last opened
        self.reconnects = 0
        self.away_ns = 0  # total time without an answer, of all lost connections
        self._last_answer_ns = 0
        self._wire: Wire | None = None
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
            self.join(timeout=10.0)

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
                raise DeviceLost(self._time_out_message(why, patience_s))
            self._stop_requested.wait(self._clock.host_s(wait_s))
            wait_s = min(2.0 * wait_s, self._timeouts.backoff_max_s)

    def _open(self) -> None:
        key = f"{self.driver.key}.port"
        try:
            path = resolve_port(self._port, key, self.driver.baud, self.driver.identify)
        except OioError:
            if not self.ready.is_set():
                raise  # the port never existed: the user must act
            raise Unplugged("the port is not there") from None
        try:
            self._wire = open_port(path, self.driver.baud, key)
        except OioError:
            if not self.ready.is_set():
                raise
            raise Unplugged("the port may not be opened") from None
        self.identity = self.driver.configure(self._wire)

    def _poll_until_lost(self) -> str:
        """Poll until the port is gone or the device times out; return the reason. Raises DeviceLost if reopening has not helped."""
        assert self._wire is not None
        opened_ns, why = self._clock.now_ns(), "silent"
        while not self._stop_requested.is_set():
            try:
                if self.driver.poll(self._wire):
                    self._note_answer()
            except NoAnswer as error:
                why = str(error) or why  # counted by the driver; a lasting silence is handled below
            except Unplugged as error:
                return str(error) or "unplugged"
            now_ns = self._clock.now_ns()
            if now_ns - self._last_answer_ns > nanoseconds(self._timeouts.reconnect_s + self._timeouts.receive_s):
                raise DeviceLost(self._time_out_message(why, self._timeouts.reconnect_s))
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
            if self._wire is not None:
                self.driver.release(self._wire)
        except (Unplugged, NoAnswer):
            pass  # the device is gone already: there is nothing to release

    def _disconnect(self, why: str) -> None:
        self.reconnects += 1
        self.lost = True
        self.news.append(("gap", f"{self.driver.key} {self.driver.name}: {why}; its port is opened anew"))
        self._close()

    def _close(self) -> None:
        if self._wire is not None:
            self._wire.close()
            self._wire = None

    def _time_out_message(self, why: str, patience_s: float) -> str:
        key = self.driver.key
        return (
            f"{key}.driver={self.driver.name} at {key}.port={self._port} did not answer for {patience_s:g} s ({why}). Check cable, power "
            f"and driver; `python -m hardware.ports` asks every port who it is."
        )
