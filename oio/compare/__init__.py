"""Comparison of calibrations, in standard deviations: `python -m oio.compare MONDAY FRIDAY`.

May import: `oio.results` and below. May not import: the command line, figures, sweeps, a stage or a device.
"""
