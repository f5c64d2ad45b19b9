"""What stays as it is while a run goes on, for the Rerun viewer: colours, sizes, box, beacon, and where to look from."""

from typing import Any

from oio.log import Setup
from oio.view.rerun_layout import NOSE_PATH, layout

ARM, NOSE, BELIEVED, BOX, BEACON, SOURCE, SPHERE, HYPOTHESIS = (
    [217, 184, 51], [200, 200, 200], [190, 90, 255], [150, 150, 150], [25, 150, 75], [230, 0, 0], [50, 130, 255], [255, 100, 25],
)  # fmt: skip


def draw_setup(recording: Any, setup: Setup) -> None:
    """Send what stands still, and how all the rest is drawn."""
    import rerun as rr

    low, high = setup.box_m
    fixed = {
        "base": rr.ViewCoordinates.RIGHT_HAND_Z_UP,
        "base/arm": rr.LineStrips3D.from_fields(radii=0.012, colors=ARM),
        NOSE_PATH: rr.LineStrips3D.from_fields(radii=0.001, colors=NOSE),
        "base/nose_believed": rr.Points3D.from_fields(radii=0.01, colors=BELIEVED, labels="believed nose"),
        "base/truth/source": rr.Points3D.from_fields(radii=0.012, colors=SOURCE, labels="true source"),
        "base/belief/spheres": rr.Ellipsoids3D.from_fields(colors=SPHERE, fill_mode="majorwireframe"),
        "base/belief/hypotheses": rr.Ellipsoids3D.from_fields(colors=HYPOTHESIS, fill_mode="transparentfillmajorwireframe"),
        "base/box": rr.Boxes3D(mins=[low], sizes=[high - low], colors=BOX, fill_mode="majorwireframe"),
    }
    if setup.beacon_m is not None:
        fixed["base/beacon"] = rr.Points3D([setup.beacon_m], radii=0.012, colors=BEACON, labels="beacon")
    for path, drawn in fixed.items():
        recording.log(path, drawn, static=True)
    recording.send_blueprint(layout(setup.box_m))
