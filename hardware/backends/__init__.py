"""Worlds: each backend combines sensor, arm and air; only `open()` makes it live.

May import: drivers, simulation, recordings, `oio`. May not import: emulators, the filter's models.
"""
