"""Results: records passed between stages, calibration file, summary, verdict, re-scoring of a log, nose trajectories.

May import: `oio.search` and below. May not import: the command line, figures, or a stage.
"""
