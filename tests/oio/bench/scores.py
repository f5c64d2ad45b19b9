"""A score of a good trial, from which tests of benchmarks make others."""

from oio.bench.score import Score

GOOD = Score(
    error_mm=8.0, nees=3.0, inside_95=True, in_region=True, bound_mm=8.0, declared=True, false=False, moves=50, time_s=40.0,
    nis=1.0, nose_mm=4.0, dead_reckoning_mm=8.0, cold_error_mm=20.0,
    cold_open_error_mm=15.0, calibration_s=50.0, error_ppm=3.0, u_a_ppm=1.0, u_b_mm=5.0, filter_mm=9.0, filter_nees=4.0,
    assumed_world="as calibrated", wrong=False, passed=True,
)  # fmt: skip
