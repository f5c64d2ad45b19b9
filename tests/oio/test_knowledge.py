"""What Type B makes of what the beacon taught."""

from dataclasses import replace

import numpy as np
import pytest

from oio.batch import Fit
from oio.knowledge import calibrated
from oio.ranging import STRAYS_MOST
from oio.uncertainty import Noise


@pytest.fixture
def known(lab):
    made = lab(5, 2, seed=1)
    fit = Fit(made.layout, made.theta(), made.cov, 0.0, 0.0, made.model.fluctuation, 100, made.law)
    return lambda inflation: calibrated(fit, made.arm, made.wander, made.nominal, replace(Noise.nominal(), inflation=inflation))


def test_misses_inflate_all_that_a_reading_may_stray_by(known):
    plain, more = known(1.0), known(4.0)
    one, other = plain.model, more.model
    assert other.fluctuation.scale == pytest.approx(4.0 * one.fluctuation.scale)
    assert other.fluctuation.gamma == pytest.approx(2.0 * one.fluctuation.gamma)
    assert other.law.stray == pytest.approx(2.0 * one.law.stray) and other.law.nose_u_m == pytest.approx(2.0 * one.law.nose_u_m)
    rest = slice(4, None)  # the source itself is forgotten
    np.testing.assert_allclose(more.cov[rest, rest], 4.0 * plain.cov[rest, rest])


def test_misses_beyond_all_measure_are_no_crash(known):
    """A room that no law holds in, such as recordings of real gas."""
    assert known(1e7).model.law.stray == STRAYS_MOST
