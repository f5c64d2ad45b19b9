"""Criteria of the verdict, one small class each: what it measures from results of the stages, never from the truth, and the next action.

`judgement`: the base class and its limits; `sensor`, `calibration`, `search`: the criteria by what they judge.
"""
