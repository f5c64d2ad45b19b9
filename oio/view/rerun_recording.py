"""Recording of the Rerun SDK, and how its viewer lays it out."""

import uuid
from typing import Any


def new_recording(address: str | None, file: str | None) -> Any:
    """Return a new recording, as a context, that goes to a viewer at an address, into a file, or to a new window."""
    import rerun
    from rerun import blueprint

    recording = rerun.RecordingStream("oio", recording_id=uuid.uuid4())
    views = (
        blueprint.TimeSeriesView(origin="gas", name="readings [ppm]"), blueprint.TimeSeriesView(origin="nis", name="NIS"),
        blueprint.TextLogView(origin="log", name="events"),
    )  # fmt: skip
    layout = blueprint.Horizontal(blueprint.Spatial3DView(origin="base", name="arm and belief"), blueprint.Vertical(*views))
    if file is not None:
        recording.save(file, default_blueprint=layout)
    elif address is not None:
        recording.connect_grpc(address, default_blueprint=layout)
    else:
        recording.spawn(default_blueprint=layout)
    return recording
