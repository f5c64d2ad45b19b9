"""The command `python -m oio.identify`: noise, drift and lags of a sensor from a run's log or a recording, as a table and as a file.

May import: `oio.cli`, `oio.figures` and below. May not import: sweeps or benchmarks.
"""
