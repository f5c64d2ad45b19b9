"""One loop for all: it ticks the plant, serves every port, and sleeps in between. One thread, so nothing needs a lock."""

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
    """Live from `run` on; ports are there from the beginning."""

    def __init__(self, lab: RealtimePlant, served: Mapping[str, EmulatedPort], agenda: EventQueue, schedule: Sequence[Fault]) -> None:
        self.lab, self._served, self._agenda, self._schedule = lab, served, agenda, schedule
        self._asked_s: float | None = None  # when somebody first spoke to a device, by the bench's clock: the schedule begins then

    def run(self, ended: Callable[[], bool]) -> None:
        """Until `ended` says so; it is asked at every tick."""
        self.lab.begin()
        while not ended():
            wait_s = min(self._agenda.next_s, self.lab.due_s) - time.monotonic()
            listened = [served for served in self._served.values() if served.port.listened]
            for served in select.select([served.port for served in listened], [], [], max(wait_s, 0.0))[0]:
                self._hear(served)
            self._agenda.run(time.monotonic())
            if time.monotonic() >= self.lab.due_s:
                self._tick()

    def _hear(self, port: object) -> None:
        self._asked_s = self.lab.tick_s if self._asked_s is None else self._asked_s
        next(served for served in self._served.values() if served.port is port).hear(time.monotonic())

    def _tick(self) -> None:
        """Devices see the plant as it is at this tick; then it goes on to the next."""
        t_s = self.lab.tick_s
        for name, served in self._served.items():
            served.trouble.clear()
            if self._asked_s is not None:
                served.trouble.update(faults.now(self._schedule, name, t_s - self._asked_s))
            served.tick(t_s, time.monotonic())
        self.lab.tick()

    @contextlib.contextmanager
    def running(self) -> Iterator[None]:
        """In a thread of its own. What it raised is raised at the end."""
        leave, errors = threading.Event(), list[BaseException]()
        thread = threading.Thread(target=self._kept, args=(leave.is_set, errors), name="emulators", daemon=True)
        thread.start()
        try:
            yield
        finally:
            leave.set()
            thread.join()
        if errors:
            raise errors[0]

    def _kept(self, ended: Callable[[], bool], errors: list[BaseException]) -> None:
        try:
            self.run(ended)
        except BaseException as error:
            errors.append(error)
