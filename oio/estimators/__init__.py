"""Recursive Bayesian filters, one per file: immutable, belief in, belief out (`base.Estimator`); `odometry` runs one on a trace.

May import: `oio.inference` and below. May not import: search strategies, stages, results.
"""
