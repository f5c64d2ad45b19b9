"""The paper's spheres: nose positions with the ranges of their readings (section II-D)."""

import numpy as np

from oio.core.records import Array
from oio.gas.range_law import RangeLaw
from oio.gas.rssi import Rssi
from oio.gas.trace import Sniffs
from oio.inference.map_fit import Fit
from oio.kinematics.arm import Arm


def range_spheres(sniffs: Sniffs, law_fit: Fit, arm: Arm, law: RangeLaw, measurements: int) -> tuple[Array, Array]:
    """Spheres of the paper: nose positions (k, 3) [m] and ranges (k,) [m] of `measurements` equal parts of the readings.

    The last third of each part, after the lag has settled, gives an RSSI, and the range law of `law_fit` a range.
    """
    lay, theta = law_fit.layout, law_fit.mean
    rssi = Rssi(1.0, law.r_ref_m, 10.0 * float(theta[lay.strength]) / np.log(10.0), float(theta[lay.exponent]))
    c = (sniffs.ppm - theta[lay.baseline][sniffs.element]) / np.exp(theta[lay.gain])[sniffs.element]
    ends = [part[-max(len(part) // 3, 1) :] for part in np.array_split(np.arange(len(c)), measurements) if len(part)]
    p = arm.nose(sniffs.q - theta[lay.offset] - 0.5 * sniffs.t_s[:, None] ** 2 * theta[lay.drift])
    levels = np.array([np.mean(c[end]) for end in ends])
    return np.array([p[sniffs.at[end[-1]]] for end in ends]), rssi.range_m(rssi.of(levels))
