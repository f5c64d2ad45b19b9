"""Benchmarks (Monte Carlo): `python -m oio.bench accuracy | drift | filters`. Whole runs over many seeds, in parallel.

May import: everything in `oio`. May not import: a stage or a device; Hydra builds those from the configuration.
"""

import oio.core.startup  # noqa: F401  - for worker processes too, so that a trial equals a run to the bit
