"""Running stages without Hydra: the context that a stage sees, the guarded and logged world, the runner that checks their order.

May import: `oio.log`, `oio.motion` and below. May not import: estimation, search, or a stage.
"""
