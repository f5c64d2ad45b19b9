"""`python -m oio.reproduce RUN`: a run is made again from what its log says of it, and compared with it to the bit.

May import: `oio.cli` and below. May not import: sweeps, benchmarks, a stage or a device. The configuration of a log is data.
"""
