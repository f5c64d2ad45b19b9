"""Benchmarks: `python -m oio.bench accuracy` and others. Experiments over many seeds, in parallel, summed up in tables and figures."""

import os

for _threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_threads, "1")  # before numpy, as in oio.run: a trial here equals a run there to the bit
