"""Places that a map leaves besides the best are scored as the best is: by position, or by bearing with one or two joints."""

from types import SimpleNamespace

import numpy as np
import pytest

from oio.inference.metrics import score_source
from oio.results.rescoring import Rescoring

TRUTH = np.array([0.30, 0.10, 0.16])
FIT = SimpleNamespace(source=np.array([0.34, 0.13, 0.16]), source_cov=np.diag([0.04, 0.01, 0.01]) ** 2, world="as calibrated")


@pytest.mark.parametrize("dof", [1, 2, 3, 5])
def test_a_place_has_the_nees_of_a_score(built, dof):
    arm = built("arm", f"dof={dof}")
    place = Rescoring._place(SimpleNamespace(source=TRUTH), FIT, arm)
    assert place.nees_source == score_source(FIT.source, FIT.source_cov, TRUTH, arm).nees
    assert place.sd_m == pytest.approx(np.sqrt(0.04**2 + 2 * 0.01**2))


def test_without_a_truth_there_is_none(built):
    assert Rescoring._place(SimpleNamespace(source=None), FIT, built("arm", "dof=5")).nees_source is None
