"""Method A for what the readings told, method B for what they did not: the prior's, or held fixed by the form of the law."""

from types import SimpleNamespace

import numpy as np
import pytest

from oio.inference.forward_model import ParameterLayout
from oio.inference.prior import FIXED
from oio.kinematics.forward import HINGE, SLIDE
from oio.results.calibration_quantities import arm_entries, range_law_entries

LAYOUT = ParameterLayout(1, 1)


def entries(shares, held=(), kind=HINGE):
    """Entries of a fit on 100 readings that left so much of the prior's standard deviation of each parameter, by index."""
    sd = np.ones(LAYOUT.size)
    for index, share in shares.items():
        sd[index] = share
    for index in held:
        sd[index] = FIXED
    fit = SimpleNamespace(layout=LAYOUT, mean=np.zeros(LAYOUT.size), cov=np.diag(sd**2), readings=100)
    fit.fluctuation = SimpleNamespace(gamma=0.1, t_s=1.0, sway=0.05)
    model = SimpleNamespace(arm=SimpleNamespace(names=("turn",), model=SimpleNamespace(kinds=np.array([kind]))))
    calibration = SimpleNamespace(cold_open=SimpleNamespace(cov=np.eye(LAYOUT.size)), chosen=SimpleNamespace(model=model))
    found = SimpleNamespace(fit=fit)
    return arm_entries(calibration, found)["turn"] | range_law_entries(calibration, found)


@pytest.mark.parametrize(("share", "method"), [(0.1, "A"), (0.70, "A"), (0.72, "B"), (1.0, "B"), (1.1, "B")])
def test_half_of_the_information_decides(share, method):
    drift = entries({LAYOUT.drift.start: share})["drift"]
    assert (drift["method"], drift["dof"]) == (method, 100 - LAYOUT.size if method == "A" else None)
    assert drift["u"] == pytest.approx(np.degrees(share))


def test_a_slide_is_in_metres():
    drift = entries({LAYOUT.drift.start: 0.1}, kind=SLIDE)["drift"]
    assert (drift["unit"], drift["u"]) == ("m/s^2", pytest.approx(0.1))


def test_a_parameter_that_the_law_holds_fixed_was_not_measured():
    exponent = entries({}, held=(LAYOUT.exponent,))["exponent"]
    assert (exponent["method"], exponent["dof"], exponent["u"]) == ("B", None, FIXED)
