"""The offset between the stamps of readings and of poses in a log, by the readings at a source of known place; either way.

In a run gas can only be stamped late, and by how much is told. In a log of two devices either clock may be ahead, and 0.4 s at 0.1 m/s
is 40 mm. A calibration of a log therefore looks for it, with the likelihood of `oio.inference.delay_fit`.
"""

from dataclasses import replace

import numpy as np

from oio.api.samples import JointPath
from oio.core.errors import BadInput
from oio.gas.timing import Delay
from oio.gas.trace import Sniffs
from oio.inference.beacon_fit import fit_beacon
from oio.inference.beacon_repeats import BeaconSurvey
from oio.inference.delay_fit import SEARCH_SIGMAS, TOLERANCE_SIGMAS, fit_delay

SURE = 3.0  # standard deviations from zero, and
CLEAR_S = 0.05  # at least so far from it, from which an offset is one


def clock_offset(survey: BeaconSurvey, sniffs: Sniffs, clock_u_s: float) -> Delay:
    """Return by how much the readings are stamped late [s], negative if the poses are, of which the prior is 0 +- clock_u_s; 0 with
    standard uncertainty 0 where it is not clearly another. Raises BadInput for one at the end of what is searched, 3 clock_u_s."""
    ahead_s = SEARCH_SIGMAS * clock_u_s
    early = replace(sniffs.only(sniffs.reading_t_s <= sniffs.t_s[-1] - ahead_s), t_s=sniffs.t_s - ahead_s)
    if len(early.reading_t_s) < 2:
        return Delay(0.0, 0.0)
    found = fit_delay(survey.problem(early), Delay(ahead_s, clock_u_s), lambda problem: fit_beacon(problem, survey.noise_scale))
    offset = Delay(found.s - ahead_s, found.u_s)
    if abs(offset.s) > ahead_s - 2.0 * TOLERANCE_SIGMAS * clock_u_s:
        late, behind = ("readings", "poses") if offset.s > 0.0 else ("poses", "readings")
        raise BadInput(
            f"the {late} seem to be stamped {ahead_s:.2g} s or more later than the {behind}, the most that is looked for (three times "
            f"clock_u_s, {clock_u_s:g} s). Set the clocks right, or look further, e.g. clock_u_s={2.0 * clock_u_s:g}."
        )
    return offset if abs(offset.s) > max(SURE * offset.u_s, CLEAR_S) else Delay(0.0, 0.0)


def moved_earlier(poses: JointPath, by_s: float) -> JointPath:
    """The path whose stamps are `by_s` [s] late, with the stamps that it should have; what came before 0 s is left out."""
    if by_s == 0.0:
        return poses
    t_s = np.asarray(poses.t_s) - by_s
    kept = t_s >= 0.0
    if np.count_nonzero(kept) < 2:
        raise BadInput(f"the poses are stamped {by_s:.2f} s late, by the calibration, and end before that. Give those of a longer time.")
    return type(poses)(t_s[kept], np.asarray(poses.q)[kept])
