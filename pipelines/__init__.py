"""Verbs: one stage per file; a stage gathers samples, calls the noun in `oio`, and returns a result."""
