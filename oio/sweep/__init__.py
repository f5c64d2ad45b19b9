"""Sweeps: many runs in one folder, in parallel, resumed where they stopped. `python -m oio.sweep` shows and compares their results.

May import: `oio.cli` and below. May not import: benchmarks, a stage or a device. Hydra finds its launchers in `hydra_plugins`.
"""

import oio.core.startup  # noqa: F401  - for worker processes too, so that a job equals a run to the bit
