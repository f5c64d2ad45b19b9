"""Exports of a run to the formats of other tools: `python -m oio.export RUN --to tum`.

May import: `oio.cli`, `oio.figures` and below. May not import: sweeps, a stage or a device.
"""
