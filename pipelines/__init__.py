"""Stages, one per file: gather samples through the context, call the mathematics in `oio`, return a result.

May import: `oio`. May not import: `hardware`, or another stage.
"""
