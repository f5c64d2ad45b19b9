"""Filters, one per file: immutable, belief in, belief out (`base.Estimator`); `odometry` runs one of them on joints and readings.

May import: `oio.inference` and below. May not import: search strategies, stages, results.
"""
