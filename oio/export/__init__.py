"""Exports of a run to the formats of other tools: `python -m oio.export RUN --to tum`.

May import: `oio.figures`, `oio.results` and below. May not import: the command line, sweeps, a stage or a device.
"""
