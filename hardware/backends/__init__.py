"""Worlds: each backend joins sensor, arm and air, and only `open()` makes it live.

May import: drivers, simulation, recordings, `oio`. May not import: emulators, the filter's models.
"""
