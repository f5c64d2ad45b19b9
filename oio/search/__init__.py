"""Where to move the nose next: one strategy per file (`base.Strategy`), when to map (`mapping_policy`), when to declare (`stop_rule`).

May import: `oio.estimators` and below. May not import: stages, results. All that a strategy may know is in a `view.View`.
"""
