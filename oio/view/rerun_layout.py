"""How the Rerun viewer lays a run out: arm and belief beside readings, NIS or joints, events and the verdict."""

from typing import Any

import numpy as np

from oio.core.records import Array

TIMELINE = "world time"  # since the world opened
TRAIL_S, AHEAD_S = 60.0, 3.0  # of the path and of the signals that are shown, and a little room before them
NOSE_PATH = "base/nose_path"
EYE = np.array([0.65, -0.8, 0.5])  # from the middle of the nose's box to the eye, in diagonals of the box


def layout(box_m: Array | None = None) -> Any:
    """Return the layout. The box of the nose (2, 3) m says where to look from; without one the viewer chooses."""
    from rerun import blueprint

    follow = blueprint.TimePanel(state="collapsed", timeline=TIMELINE, play_state="following")
    closed = blueprint.BlueprintPanel(state="collapsed"), blueprint.SelectionPanel(state="collapsed")
    views = blueprint.Horizontal(_space(box_m), _signals(), column_shares=[3, 2])
    return blueprint.Blueprint(views, follow, *closed, auto_layout=False, auto_views=False)


def _from_the_cursor(seconds: float) -> Any:
    from rerun import blueprint

    return blueprint.TimeRangeBoundary.cursor_relative(seconds=seconds)


def _space(box_m: Array | None) -> Any:
    from rerun import blueprint

    trail = blueprint.VisibleTimeRanges(timeline=TIMELINE, start=_from_the_cursor(-TRAIL_S), end=_from_the_cursor(0.0))
    return blueprint.Spatial3DView(origin="base", name="arm and belief", eye_controls=_eye(box_m), overrides={NOSE_PATH: trail})


def _eye(box_m: Array | None) -> Any:
    from rerun import blueprint

    if box_m is None:
        return None
    middle, diagonal_m = box_m.mean(axis=0), float(np.linalg.norm(box_m[1] - box_m[0]))
    return blueprint.EyeControls3D(position=middle + diagonal_m * EYE, look_target=middle, eye_up=[0.0, 0.0, 1.0])


def _signals() -> Any:
    from rerun import blueprint

    window = blueprint.TimeAxis(view_range=blueprint.TimeRange(start=_from_the_cursor(-TRAIL_S), end=_from_the_cursor(AHEAD_S)))
    readings, nis, joints = (
        blueprint.TimeSeriesView(origin=origin, name=name, axis_x=window)
        for origin, name in (("gas", "readings [ppm]"), ("nis", "NIS"), ("joints", "joints [rad or m]"))
    )
    columns = blueprint.TextLogColumns(text_log_columns=["loglevel", "body"])
    events = blueprint.TextLogView(origin="log", name="events", columns=columns)
    verdict = blueprint.TextDocumentView(origin="verdict", name="verdict")
    return blueprint.Vertical(readings, blueprint.Tabs(nis, joints, active_tab=0), events, verdict, row_shares=[5, 5, 5, 3])
