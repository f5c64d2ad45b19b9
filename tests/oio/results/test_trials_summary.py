"""Summary of several trials: medians, shares, words, and their distribution."""

import pytest

from oio.results.trials_summary import summary_of_trials

IDENTITY = {"sensor": "ec", "seed": 7, "dof": 5}


def outcome(error_m, inside=True, found=False, nees=3.0):
    return {"source_error_m": error_m, "inside_95": inside, "found": found, "nees_source": nees, "moves": 10, "believed_m": [1.0, 2.0, 3.0]}


def trial(error_m, verdict="PASS", scored="RIGHT", world="as calibrated", **further):
    judged = {"name": "nis", "word": verdict}
    return {
        "sensor": "ec", "dof": 5, "calibrated": {**outcome(error_m, **further), "world": world}, "cold": outcome(2 * error_m),
        "verdict": verdict, "scored": {"word": scored, "reasons": []}, "criteria": [judged], "protocol": None,
        "source_position_m": [0, 0, 1],
    }  # fmt: skip


def summarised(*trials, failed=None):
    return summary_of_trials(IDENTITY, trials, [7 + i for i in range(len(trials) + len(failed or {}))], failed or {})


def test_numbers_are_medians_yes_is_a_share_words_the_most_frequent_and_lists_nothing():
    made = summarised(trial(0.01), trial(0.03, inside=False, world="a wall"), trial(0.02))
    assert made["calibrated"]["source_error_m"] == 0.02 and made["cold"]["source_error_m"] == 0.04
    assert made["calibrated"]["inside_95"] == pytest.approx(2 / 3) and made["calibrated"]["found"] == 0.0
    assert made["calibrated"]["world"] == "as calibrated" and made["calibrated"]["believed_m"] is None
    assert made["source_position_m"] is None and made["protocol"] is None
    assert (made["seed"], made["dof"]) == (7, 5)  # no median of the choices


@pytest.mark.parametrize(
    "words, word", [("PPW", "PASS"), ("PPWW", "WARN"), ("PF", "FAIL"), ("PWF", "FAIL"), ("WWF", "WARN"), ("P", "PASS")]
)
def test_the_verdict_is_that_of_most_and_the_worse_of_two(words, word):
    names = {"P": "PASS", "W": "WARN", "F": "FAIL"}
    assert summarised(*(trial(0.01, verdict=names[letter]) for letter in words))["verdict"] == word


def test_the_distribution_counts_what_a_median_hides():
    made = summarised(
        trial(0.01, found=True), trial(0.2, inside=False, found=True, scored="WRONG", nees=300.0), trial(0.012, verdict="WARN"),
        failed={9: "no gas"},
    )["distribution"]  # fmt: skip
    assert (made["trials"], made["first_seed"], made["failed"]) == (4, 7, {"9": "no gas"})
    calibrated = made["outcomes"]["calibrated"]
    assert calibrated["source_error_m"]["worst"] == 0.2 and calibrated["source_error_m"]["median"] == 0.012
    assert calibrated["in_95"]["count"] == 2 and calibrated["in_95"]["low"] < 2 / 3 < calibrated["in_95"]["high"]
    assert calibrated["declared"]["share"] == pytest.approx(2 / 3)
    assert calibrated["anees"]["value"] == pytest.approx((1 + 100 + 1) / 3)
    assert calibrated["anees"]["low"] < 1.0 < calibrated["anees"]["high"] < 5.0
    assert made["verdicts"] == {"PASS": 2, "WARN": 1} and made["scored"] == {"RIGHT": 2, "WRONG": 1}
    assert made["pass_but_wrong"] == 1 and made["criteria"] == {"nis": {"PASS": 2, "WARN": 1}}


def test_a_bearing_is_told_in_degrees_and_has_no_anees():
    made = trial(0.01)
    made["calibrated"] = {**made["calibrated"], "source_error_m": None, "bearing_error_deg": 4.0}
    found = summarised(made, made)["distribution"]["outcomes"]["calibrated"]
    assert found["bearing_error_deg"]["median"] == 4.0 and found["anees"] is None


def test_what_no_trial_has_is_nothing():
    made = trial(0.01)
    made["calibrated"] = {**made["calibrated"], "nees_source": float("nan"), "inside_95": None}
    made["cold"] = None
    found = summarised(made, made)
    assert found["cold"] is None and found["calibrated"]["nees_source"] is None
    assert found["distribution"]["outcomes"]["calibrated"]["in_95"] is None and "cold" not in found["distribution"]["outcomes"]
