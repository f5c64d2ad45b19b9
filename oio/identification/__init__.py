"""Identification of a sensor from its readings: noise and drift, stationarity, lags, delay, twin elements, environment.

May import: `oio.core`. May not import: gas, motion, or anything above.
"""
