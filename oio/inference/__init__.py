"""Estimation: the state space, the forward model, the MAP fit and the belief map, Type A and B (eq. 2, 3), bounds, observability, metrics.

May import: `oio.gas` and below. May not import: filters, search strategies, stages, or `oio.runtime`, its neighbour.
"""
