"""The filter before and after calibration on the same samples, read back from the log and drawn."""

from typing import ClassVar

from oio.core.interfaces import Sensor
from oio.core.settings import settings
from oio.estimators.base import Estimator
from oio.estimators.odometry import Odometry
from oio.figures.ekf import draw
from oio.inference.base import Localizer
from oio.kinematics.arm import Arm
from oio.results.calibration import Calibration, Navigation
from oio.results.rescoring import Rescoring, Variant
from oio.results.tracks import Tracks, tracks
from oio.runtime.context import Context
from oio.search.stop_rule import StopRule


@settings
class DrawEkf:
    """Writes figure_ekf.png beside the log."""

    needs: ClassVar[tuple[type, ...]] = (Calibration, Navigation)
    sensor: Sensor
    arm: Arm
    ekf: Estimator
    belief_map: Localizer
    stop: StopRule  # as navigate's

    def run(self, context: Context) -> Tracks:
        """Both filters make their maps when the search made them."""
        known, search = context.need(Calibration), context.need(Navigation)
        starts = {"cold": known.cold, "calibrated": known.chosen}
        plain = self.belief_map.as_calibrated  # the search's own maps are on record
        variants = {name: Variant(Odometry(self.ekf, at, plain), at is known.chosen) for name, at in starts.items()}
        rerun = Rescoring(variants, self.sensor, search, self.stop)
        found = tracks(rerun, self.arm, context.log.samples(search.began_ns, search.ended_ns))
        draw(found, context.out / "figure_ekf.png")
        context.log.progress(context.world.t_ns, "figure_ekf.png", "drawn")
        return found
