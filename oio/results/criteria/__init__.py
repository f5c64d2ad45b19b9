"""Criteria of the verdict, one small class each: what it measures from results of the stages, never from the truth, and the next action.

`judgement`: the base class and its limits; `sensor`, `clocks`, `calibration`, `safety`, `consistency`, `search`: the criteria by what they
judge.
May import: results of the stages and below. May not import: the command line, a stage or a device.
"""
