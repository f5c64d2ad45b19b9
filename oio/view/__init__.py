"""Views of a run in the Rerun viewer, while it goes on or from its log; `python -m oio.view` is the command.

May import: `oio.runtime`, `oio.log`, `oio.kinematics` and below. May not import: estimation, results, or the command `oio.run`.
"""
