"""A clock for tests of drivers that need no real time."""

from oio.core.records import nanoseconds


class Stepped:
    """A clock that goes on only while somebody sleeps, or a device answers."""

    def __init__(self):
        self.t_ns, self.suspended_s = 0, 0.0

    def now_ns(self):
        return self.t_ns

    def host_s(self, world_s):
        return world_s

    def sleep(self, seconds):
        self.t_ns += nanoseconds(seconds)
