"""Estimation: state-space and forward model, MAP fit, belief map, Type A and B (eq. 2, 3), Cramer-Rao bounds, observability, metrics.

May import: `oio.gas` and below. May not import: filters, search strategies, stages, or `oio.runtime`, its neighbour.
"""
