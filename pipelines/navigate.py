"""Find a source at a new, unknown place: explore, map, then sniff where it tells most, until the belief is narrow enough to say so."""

from typing import ClassVar

import numpy as np

from oio.core.errors import WorldEnded
from oio.core.settings import settings
from oio.gas.signal_range import gas_signals
from oio.results.calibration import Calibration, Navigation
from oio.runtime.context import Context
from oio.search.closed_loop import ClosedLoop
from oio.search.loop_settings import LoopSettings


@settings
class Navigate(LoopSettings):
    """The closed loop, its goals chosen by the strategy; its fields are those of `LoopSettings`."""

    needs: ClassVar[tuple[type, ...]] = (Calibration,)

    def run(self, context: Context) -> Navigation:
        """Searches with the calibrated filter in the chosen assembly; beliefs go to the log at every map, and at a rate between."""
        calibration = context.need(Calibration)
        loop = ClosedLoop(self, context, calibration.chosen, calibration.baselines)
        while not loop.over:
            try:
                loop.move(loop.proposed())
            except WorldEnded:
                break  # a log or a recording is over: what is believed by now is the answer
        loop.finish()
        return self._navigation(context, loop)

    def _navigation(self, context: Context, loop: ClosedLoop) -> Navigation:
        source = loop.odometry.source()
        place = tuple(float(v) for v in source[0]) if source is not None else (np.nan,) * 3
        spread = float(np.sqrt(np.trace(source[1]))) if source is not None else np.inf
        times, fits = tuple(t_ns for t_ns, _ in loop.maps), tuple(fits for _, fits in loop.maps)
        return Navigation(
            loop.began_ns, context.world.t_ns, times, fits, tuple(loop.ends_ns), loop.moves, loop.declared, place, spread,
            context.world.gaps(), gas_signals(loop.odometry.trace, context.need(Calibration).baselines), context.world.guard_account(),
        )  # fmt: skip
