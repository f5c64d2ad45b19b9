"""Figures of a run, drawn from its log alone: `python -m oio.figures RUN_DIR`.

May import: `oio.results` and below. May not import: the command line or a stage. matplotlib is imported here only.
"""
