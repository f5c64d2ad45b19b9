"""Halton's points are scipy's."""

import numpy as np
from scipy.stats import qmc

from oio.inference.sampling import halton


def test_the_points_are_those_of_scipy_to_the_bit():
    np.testing.assert_array_equal(halton(200), qmc.Halton(3, scramble=False).random(200))
