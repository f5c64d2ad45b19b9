"""Run log: one MCAP file (Protobuf, Foxglove schemas where one fits). No other part of OIO depends on the format.

May import: `oio.core`. May not import: anything that interprets what is logged.
"""

from oio.log.damage_survey import RecoveryReport
from oio.log.entries import ArmFrames, BeliefScene, BelievedNose, Entry, Progress, Setup, StageMark, Watcher
from oio.log.logged_run import LoggedRun, read_run
from oio.log.memory_log import MemoryLog
from oio.log.read import (
    read_attachment,
    read_beliefs,
    read_end,
    read_entries,
    read_events,
    read_filter_estimates,
    read_hypotheses,
    read_innovations,
    read_metadata,
    read_odometry,
    read_readings,
    read_samples,
    read_stages,
    read_states,
)
from oio.log.salvage import recover, salvage
from oio.log.write import Journal, RunLog

__all__ = [
    "ArmFrames",
    "BeliefScene",
    "BelievedNose",
    "Entry",
    "Journal",
    "LoggedRun",
    "MemoryLog",
    "Progress",
    "RecoveryReport",
    "RunLog",
    "Setup",
    "StageMark",
    "Watcher",
    "read_attachment",
    "read_beliefs",
    "read_end",
    "read_entries",
    "read_events",
    "read_filter_estimates",
    "read_hypotheses",
    "read_innovations",
    "read_metadata",
    "read_odometry",
    "read_readings",
    "read_run",
    "read_samples",
    "read_stages",
    "read_states",
    "recover",
    "salvage",
]
