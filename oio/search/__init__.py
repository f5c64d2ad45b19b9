"""Search strategies, one per file (`base.Strategy`): where to move the nose next. When to map: `mapping_policy`; when to stop: `stop_rule`.

May import: `oio.estimators` and below. May not import: stages, results. All the input of a strategy is in a `view.View`.
"""
