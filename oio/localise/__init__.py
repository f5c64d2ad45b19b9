"""The command `python -m oio.localise`: where the source is, from the log of a nose that was moved, as sentences, a file and a picture.

May import: `oio.api`, `oio.figures` and below. May not import: benchmarks.
"""
