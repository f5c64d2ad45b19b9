"""Worlds that are to be solved, not only doubted: most searches declare the source, where it is."""

import numpy as np
import pytest

from oio.bench.score import NEES_3_SIGMA
from oio.bench.trial import run_trial

WORLDS = ("wind_begins", "wind_turns", "second_source", "fading")
SEEDS = (223, 224)
FAR_M = 0.03  # three times stop.sd_m


@pytest.mark.slow
def test_a_changed_wind_a_second_source_and_a_fading_one_are_found_and_declared():
    """ndir in a draft: 5 of 8 declared, errors of 4 to 15 mm. With 120 moves 1 of 16 was, on other seeds."""
    found = [run_trial(("sensor=ndir", "air=draft", "dof=5", f"world={world}"), seed)["calibrated"] for world in WORLDS for seed in SEEDS]
    declared = [outcome for outcome in found if outcome["found"]]
    assert len(declared) >= len(found) / 2
    assert np.median([outcome["source_error_m"] for outcome in found]) <= 0.025
    assert all(outcome["source_error_m"] <= FAR_M and outcome["nees_source"] <= NEES_3_SIGMA for outcome in declared)
