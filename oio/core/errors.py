"""Errors that a person can act on: what was given, what is allowed, what to type."""


class OioError(Exception):
    """A known failure at run time; `python -m oio.run` prints it as one paragraph and ends with exit code 1."""

    exit_code = 1


class BadInput(OioError):
    """Something given from outside is wrong (a key, a value, a file); exit code 2, nothing was run."""

    exit_code = 2


class NotSettled(OioError):
    """The sensor still drifts after the longest allowed warm-up."""


class NotObservable(OioError):
    """The motion so far cannot determine what was asked for."""


class WorldEnded(OioError):
    """The world has no more samples: a recording is over, a log ends, a device went away."""
