"""Real recordings: one loader per format. All are read alike, and what cannot be used is counted, never guessed.

May import: `oio`. May not import: drivers, simulation, worlds.
"""
