"""Recording of the Rerun SDK: loaded, begun, and sent to where it goes."""

import gc
import importlib
import uuid
from typing import Any

from oio.view.rerun_layout import layout

FLUSH_S = 0.1  # the SDK's own 8 ms wake a thread that takes 3 % of a run's time


def new_recording(address: str | None, file: str | None) -> Any:
    """Return a new recording, as a context, that goes to a viewer at an address, into a file, or to a new window."""
    _load()
    import rerun

    often = rerun.ChunkBatcherConfig(flush_tick=FLUSH_S)
    recording = rerun.RecordingStream("oio", recording_id=uuid.uuid4(), batcher_config=often)
    recording.set_log_time_enabled(False)  # nothing is drawn at the time of day when it was sent
    if file is not None:
        recording.save(file, default_blueprint=layout())
    elif address is not None:
        recording.connect_grpc(address, default_blueprint=layout())
    else:
        recording.spawn(default_blueprint=layout())
    return recording


def _load() -> None:
    """Load the SDK, and leave all that is loaded by now out of garbage collection.

    With its two thousand classes, the collector would search the whole process over and over while they are made, then all of them with
    the rest as long as the run goes on, and once more when it ends: half of what a view costs.
    """
    was_on = gc.isenabled()
    gc.disable()
    try:
        importlib.import_module("rerun")
        gc.freeze()
    finally:
        if was_on:
            gc.enable()
