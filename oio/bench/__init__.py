"""Benchmarks: `python -m oio.bench accuracy | drift | filters`. Whole runs over many seeds, in parallel, with tables and figures.

May import: everything in `oio`. May not import: a stage or a device; Hydra builds those from the configuration.
"""

import oio.cli.startup  # noqa: F401  - workers import it too, so that a trial here equals a run there to the bit
