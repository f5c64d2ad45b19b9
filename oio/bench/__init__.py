"""Benchmarks: `python -m oio.bench accuracy` and others. Experiments over many seeds, in parallel, summed up in tables and figures."""

import oio.cli.startup  # noqa: F401  - workers import it too, so that a trial here equals a run there to the bit
