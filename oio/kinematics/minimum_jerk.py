"""The minimum-jerk profile of a move between two poses at rest (Flash & Hogan 1985, J. Neurosci. 5:1688)."""

PEAK_OVER_MEAN = 1.875  # its peak speed over its mean speed, 15 / 8


def minimum_jerk(fraction: float) -> float:
    """Share of the way after that fraction of the time, 10 x^3 - 15 x^4 + 6 x^5 on [0, 1]; 0 before and 1 after."""
    x = min(max(fraction, 0.0), 1.0)
    return x * x * x * (10.0 + x * (6.0 * x - 15.0))
