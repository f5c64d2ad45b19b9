"""Event loop of the emulators: ticks the plant, serves every port and sleeps in between. Single-threaded, so it needs no lock."""

import contextlib
import select
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence

from hardware.emulators import faults
from hardware.emulators.emulated_port import EmulatedPort, EventQueue
from hardware.emulators.faults import Fault
from hardware.emulators.realtime_plant import RealtimePlant


class Loop:
    """Event loop of an emulated bench, live from `run` on; the ports exist from the start."""

    def __init__(self, realtime: RealtimePlant, served: Mapping[str, EmulatedPort], agenda: EventQueue, schedule: Sequence[Fault]) -> None:
        self.realtime, self._served, self._agenda, self._schedule = realtime, served, agenda, schedule
        self._first_request_s: float | None = None  # bench time of the first request to any device, at which the fault schedule starts

    def run(self, ended: Callable[[], bool]) -> None:
        """Run until `ended` returns true; it is called at every tick."""
        self.realtime.begin()
        while not ended():
            wait_s = min(self._agenda.next_s, self.realtime.due_s) - time.monotonic()
            listened = [served for served in self._served.values() if served.port.listened]
            for served in select.select([served.port for served in listened], [], [], max(wait_s, 0.0))[0]:
                self._hear(served)
            self._agenda.run(time.monotonic())
            if time.monotonic() >= self.realtime.due_s:
                self._tick()

    def _hear(self, port: object) -> None:
        self._first_request_s = self.realtime.tick_s if self._first_request_s is None else self._first_request_s
        next(served for served in self._served.values() if served.port is port).hear(time.monotonic())

    def _tick(self) -> None:
        """Serve the devices with the plant as it is at this tick, then advance it to the next."""
        t_s = self.realtime.tick_s
        for name, served in self._served.items():
            served.trouble.clear()
            if self._first_request_s is not None:
                served.trouble.update(faults.active_kinds(self._schedule, name, t_s - self._first_request_s))
            served.tick(t_s, time.monotonic())
        self.realtime.tick()

    @contextlib.contextmanager
    def running(self) -> Iterator[None]:
        """Run the loop in a thread of its own; its exception is raised at the end of the context."""
        stop_requested, errors = threading.Event(), list[BaseException]()
        thread = threading.Thread(target=self._run_and_keep_error, args=(stop_requested.is_set, errors), name="emulators", daemon=True)
        thread.start()
        try:
            yield
        finally:
            stop_requested.set()
            thread.join()
        if errors:
            raise errors[0]

    def _run_and_keep_error(self, ended: Callable[[], bool], errors: list[BaseException]) -> None:
        try:
            self.run(ended)
        except BaseException as error:
            errors.append(error)
