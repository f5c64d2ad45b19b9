"""What stages hand to each other and what a run leaves: calibration, its file, summary, verdict, re-scoring of a log, tracks.

May import: `oio.search` and below. May not import: the command line, figures, or a stage.
"""
