"""Process noise: the densities of the random walks of the state; `oio.inference.state_space` makes the matrix Q(dt) of them."""

from typing import Annotated

from oio.core.settings import Within, settings


@settings
class ProcessNoise:
    """Process noise of slowly varying states: random-walk densities."""

    offset_deg_sqrt_s: Annotated[float, Within(0, 10)]  # of the joint offsets: reversal of the backlash [deg / sqrt(s)]
    drift_deg_s2_sqrt_s: Annotated[float, Within(0, 1)]  # of the encoders' acceleration [deg / s^2 / sqrt(s)]
    strength_sqrt_s: Annotated[float, Within(0, 100)]  # of ln strength [1 / sqrt(s)]
    exponent_sqrt_s: Annotated[float, Within(0, 10)]  # of the range exponent
    wind_per_m_sqrt_s: Annotated[float, Within(0, 1e4)]  # of k [1 / m / sqrt(s)]
    rest_speed_rad_s: Annotated[float, Within(0, 10)]  # a joint slower than this is at rest: velocities are differences of counts
    baseline_sigmas_sqrt_s: Annotated[float, Within(0, 1e4)]  # of the offsets, in standard deviations of one reading
