"""Loaders of real recordings, one per format. All are read alike; unusable rows are counted, never guessed.

May import: `oio`. May not import: drivers, simulation, worlds.
"""
