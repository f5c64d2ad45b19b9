"""Every criterion that ships passes, warns and fails on data made for it, and says what to do."""

import re
from dataclasses import fields, replace
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from hydra.utils import instantiate

from oio.core.errors import BadInput
from oio.core.folders import CONF, ROOT
from oio.gas.bout_rates import Rate
from oio.gas.bouts import ElementBaseline
from oio.gas.exposures import Exposures
from oio.gas.timing import Delay
from oio.identification.allan_slope import EndSlope
from oio.inference.map_fit import CALIBRATED
from oio.inference.metrics import ResidualTest
from oio.inference.rise_and_fall import Lag, RiseAndFall
from oio.inference.uncertainty import TypeB
from oio.motion.guard_account import GuardAccount
from oio.results.calibration import BaselineResult, BoutCalibration, Calibration, Kept, MapCalibration, Navigation, WarmUpResult
from oio.results.evaluation import Evaluation, Findings, Outcome, Place, Scored
from oio.results.verdict import judge
from oio.runtime.gas_stream import StreamGaps
from oio.search.view import Move

STANDARD = instantiate(yaml.safe_load((CONF / "verdict" / "standard.yaml").read_text()), _convert_="all")
OUTCOME = Outcome(0.01, None, 0.005, 3.0, True, 1.0, 8, 60.0, True, 0.05, (0.3, 0.0, 0.2), 0.01)
FINDINGS = Findings(ResidualTest(0.9, 0.1, 2.0), (), 5, 0.3, 500, 0)
STREAM = StreamGaps(1000, 0, 2.0, 0.1, 0.05)
GUARD = GuardAccount((), 0.64, 0.8, ())


def warm_up(slope=0.1, u=0.2, noise=1.0, drift=None):
    return WarmUpResult(10.0, (0.0, slope), (0.1, u), (1.0, noise), 20, 0.05, drift)


def drift(slope, ramp=0.0):
    return warm_up(drift=EndSlope(slope, 64.0, 600.0, ramp))


def baseline(effective=3.0):
    return BaselineResult((ElementBaseline(5.0, 0.1, 5.2, 5, 5.0), ElementBaseline(5.0, 0.1, 5.2, 5, effective)), 1.0, 0)


def beacon(
    lag_u=0.03, repeats=6, nees=3.0, rms_m=0.02, delay_u_s=0.02, rise_u=0.1, fall_u=0.03, ratio=1.0, fired=6, guard=GUARD, **stream
):  # fmt: skip
    fit = SimpleNamespace(layout=SimpleNamespace(tau=0), cov=np.array([[lag_u**2]]))
    type_b, gaps = TypeB((5,) * repeats, (rms_m,) * repeats, 0.02, rms_m, 1.0, 0.0), replace(STREAM, **stream)
    lags, exposed = RiseAndFall(Lag(2.0, rise_u), Lag(2.6, fall_u), ratio, 0.1), Exposures(Rate(fired, 6), Rate(20, 24), Rate(3, 6))
    return MapCalibration(
        fit, (SimpleNamespace(nees=nees),) * repeats, type_b, 0, 1.0, 40, Delay(0.12, delay_u_s), gaps, 0.3, lags, exposed, (40.0,), guard
    )  # fmt: skip


def moved(**guard):
    return beacon(guard=replace(GUARD, **guard))


def search(gas_ppm=30.0, whiffs=2):
    made = tuple(Move(np.zeros(5), 0.0, 1.0, np.zeros(5) if i < whiffs else None) for i in range(4))
    return Navigation(0, 1, (), (), (), made, True, (0.3, 0.0, 0.2), 0.01, STREAM, (gas_ppm,), GUARD)


def met(**met):
    return loaded(), search(**met)


def evaluation(findings=FINDINGS, **outcome):
    return Evaluation(OUTCOME, OUTCOME, replace(OUTCOME, **outcome), None, None, None, None, findings, Scored("unknown", ()), None, 1.0)


def residuals(*values, **outcome):
    return evaluation(replace(FINDINGS, residuals=ResidualTest(*values)), **outcome)


def places(others):
    return evaluation(other_places=(Place((0.3, 0.1, 0.2), 0.01, CALIBRATED, None),) * others)


def unseen(dof, *sentences):
    return evaluation(replace(FINDINGS, dof=dof, unseen=sentences))


def gated(count):
    return evaluation(replace(FINDINGS, gated=count))


def bouts(rate=0.03):
    return BoutCalibration((), None, rate)


def loaded(*remarks, highest_ppm=(40.0,), verdict="PASS"):
    baselines = (ElementBaseline(5.0, 0.1, 5.2, 5, 5.0),)
    return Calibration(*[None] * 5, 85.0, 0.5, 0.2, 0.02, 50, baselines, highest_ppm, Kept("monday/calibration.yaml", verdict, remarks))


GOOD = (drift(-0.4), baseline(), bouts(), beacon(), loaded(), search(), evaluation())
CASES = {  # name: results that pass, warn and fail, each with a word of what is said
    "warm_up": [(warm_up(), "+0.10"), (warm_up(-0.5, 0.2), "-0.50 +- 0.20"), (warm_up(1.0, 0.2), "+1.00")],
    "drift": [(drift(-0.4), "-0.40 at tau = 64 s"), (drift(0.7), "+0.70"), (drift(0.998, 0.01), "+1.00")],
    "baseline": [(baseline(2.0), "count as 2.0"), (baseline(1.2), "count as 1.2"), (baseline(1.05), "30 or more are recommended")],
    "noise": [(warm_up(noise=1.1), "1.1 times"), (warm_up(noise=5.0), "element 1 has 5 times"), (warm_up(noise=20.0), "20 times")],
    "clocks": [(beacon(missing=4), "4 of 1000"), (beacon(missing=15), "15 of"), (beacon(missing=30), "silence is 2.0 s")],
    "streams": [
        (beacon(), "together"), (beacon(joints_after_s=1.4), "gas stream stops 1.4 s before the joint stream"),
        (beacon(joints_after_s=3.1), "gas stream stops 3.1 s before the joint stream"),
    ],
    "delay": [(beacon(delay_u_s=0.04), "0.12 +- 0.08 s"), (beacon(delay_u_s=0.08), "0.16 s"), (beacon(delay_u_s=0.2), "every 0.1 s")],
    "steps": [(beacon(), "rise 2 s +- 20 % and fall 2.6 s +- 6 %"), (beacon(rise_u=0.9), "rise not seen and fall 2.6 s"),
              (beacon(rise_u=0.9, fall_u=0.9), "rise not seen and fall not seen")],
    "lag": [(beacon(0.05), "10 %"), (beacon(0.12), "24 %"), (beacon(0.15), "30 %")],
    "bout_rule": [(bouts(0.03), "3.0 % of readings of white noise"), (bouts(0.08), "8.0 %"), (bouts(0.25), "25.0 %")],
    "bout_detection": [(beacon(fired=6), "6 of 6"), (beacon(fired=5), "5 of 6"), (beacon(fired=4), "83 % near it, 50 % away")],
    "safety": [(moved(), "0.64 m/s at most, limit 0.8"), (moved(top_speed_m_s=0.83), "0.83"), (moved(top_speed_m_s=0.9), "0.90")],
    "kept": [
        (loaded(), "nothing speaks against it"), (loaded("its own verdict was WARN."), "its own verdict was WARN"),
        (loaded("its own verdict was FAIL.", verdict="FAIL"), "its own verdict was FAIL"),
    ],
    "repeats": [(beacon(repeats=5), "5 times"), (beacon(repeats=2), "2 times"), (beacon(repeats=1), "1 times")],
    "beacon_error": [(beacon(rms_m=0.02), "20 mm"), (beacon(rms_m=0.06), "60 mm"), (beacon(rms_m=1.5), "1500 mm")],
    "beacon_nees": [(beacon(nees=3.0), "1.00"), (beacon(nees=12.0), "4.00"), (beacon(nees=30.0), "10.00")],
    "observable": [(unseen(5), "every"), (unseen(1), "only the bearing"), (unseen(5, "a.", "b.", "c.", "d."), "a. B. C. D")],
    "nis": [(evaluation(nis_mean=1.0), "1.00"), (evaluation(nis_mean=1.9), "1.90"), (evaluation(nis_mean=3.0), "3.00")],
    "gated": [(gated(2), "2 of 500"), (gated(10), "10 of 500"), (gated(40), "40 of 500 innovations (8.0 %; at least 6.1 %")],
    "residuals": [(residuals(0.9, 0.1), "0.90"), (residuals(1.8, 0.0), "1.80"), (residuals(0.9, 0.6), "together 3.60")],
    "halves": [(residuals(1.0, 0.0, 2.0), "2.0"), (residuals(1.0, 0.0, 14.0), "14.0"), (residuals(1.0, 0.0, 20.0), "20.0")],
    "places": [(places(0), "one place"), (places(1), "2 places"), (places(3), "4 places")],
    "localised": [(evaluation(sd_m=0.01), "10 mm"), (evaluation(sd_m=0.03), "30 mm"), (evaluation(sd_m=2.0), "not localisable")],
    "gas_range": [
        (met(), "0.75 times the calibration's strongest (40 ppm)"), (met(gas_ppm=800.0), "20 times"), (met(gas_ppm=8000.0), "200 times"),
    ],
    "world": [
        (evaluation(), "calibrated world"), (evaluation(world="a wall"), "a wall explains"),
        (residuals(0.9, 0.6, world="a wall"), "a wall, which does better, does not either"),
    ],
    "declared": [
        (evaluation(), "after 8 moves"), (evaluation(found=False), "not declared within 8 moves"),
        (evaluation(found=False, believed_m=None), "8 moves, and no map"),
    ],
}  # fmt: skip
TOO_LITTLE = {  # the other side of what is judged from both
    "streams": [beacon(joints_after_s=-1.4), beacon(joints_after_s=-3.1)],
    "noise": [warm_up(noise=0.05), warm_up(noise=0.0)],
    "beacon_nees": [beacon(nees=0.09), beacon(nees=0.03)],
    "nis": [evaluation(nis_mean=0.4), evaluation(nis_mean=0.1)],
    "residuals": [residuals(0.3, 0.0), residuals(0.1, 0.0)],
}


def judgement(name, results):
    results = results if isinstance(results, tuple) else (results,)
    (found,) = [j for j in judge({type(result): result for result in results}, STANDARD).judgements if j.name == name]
    return found


def judged(*results):
    return {j.name: j for j in judge({type(result): result for result in results}, STANDARD).judgements}


def test_every_criterion_that_ships_has_its_cases():
    assert set(CASES) == set(STANDARD.criteria)


@pytest.mark.parametrize("name", CASES)
def test_each_passes_warns_and_fails_with_a_reason_and_an_action(name):
    for word, (result, says) in zip(("PASS", "WARN", "FAIL"), CASES[name], strict=True):
        found = judgement(name, result)
        assert found.word == word and says in found.found
        assert bool(found.action) == (word != "PASS")


@pytest.mark.parametrize("name", TOO_LITTLE)
def test_too_little_fails_too_with_another_action(name):
    too_much = judgement(name, CASES[name][2][0])
    for word, result in zip(("WARN", "FAIL"), TOO_LITTLE[name], strict=True):
        found = judgement(name, result)
        assert found.word == word and found.action and found.action != too_much.action


@pytest.mark.parametrize(("slope", "u"), [(0.1, np.inf), (np.nan, 0.2), (0.1, np.nan)])
def test_a_trend_that_cannot_be_told_fails(slope, u):
    assert judgement("warm_up", warm_up(slope, u)).word == "FAIL"


def test_a_good_run_passes_and_the_worst_word_counts():
    results = {type(result): result for result in GOOD}
    good = judge(results, STANDARD)
    assert good.word == "PASS" and good.reasons == () and len(good.judgements) == len(STANDARD.criteria)
    worse = judge(results | {WarmUpResult: warm_up(-0.5, 0.2)}, STANDARD)
    assert worse.word == "WARN" and worse.reasons[0].startswith("warm_up: drift -0.50")
    worst = judge(results | {WarmUpResult: warm_up(-0.5, 0.2), Evaluation: evaluation(nis_mean=9.0)}, STANDARD)
    assert worst.word == "FAIL" and [reason.split(":")[0] for reason in worst.reasons] == ["nis", "warm_up"]


def test_only_noise_is_a_remark_with_another_action():
    noise, near = judgement("gas_range", met(gas_ppm=2.0, whiffs=0)), judgement("gas_range", met(gas_ppm=0.1))
    assert (noise.word, near.word) == ("WARN", "WARN") and "only noise" in noise.found
    assert len({noise.action, near.action, judgement("gas_range", met(gas_ppm=800.0)).action}) == 3


def test_an_element_that_was_seen_least_decides():
    two = (ElementBaseline(5.0, 0.1, 5.2, 5, 5.0),) * 2
    known = replace(loaded(highest_ppm=(40.0, 10.0)), baselines=two)
    assert judgement("gas_range", (known, replace(search(), gas_ppm=(30.0, 80.0)))).value == 8.0


@pytest.mark.parametrize("hole", [{"without_limit": ("pan", "arm.box_low_m")}, {"load_unwatched": ("tilt",)}])
def test_a_missing_limit_fails_however_slow_the_arm(hole):
    found = judgement("safety", moved(**hole))
    assert found.word == "FAIL" and all(name in found.found for names in hole.values() for name in names)


def test_a_recovery_slower_than_the_data_sheet_says_is_named_where_it_is_beyond_doubt():
    assert "has one factor for both" in judgement("steps", beacon(ratio=1.8)).found
    for doubtful in (beacon(ratio=1.2), beacon(ratio=1.8, rise_u=0.9)):
        assert "factor" not in judgement("steps", doubtful).found


def test_steps_and_drift_say_what_was_not_seen():
    assert "source is too weak" in judgement("steps", beacon(rise_u=0.9, fall_u=0.9)).action
    assert "The rise was not seen" in judgement("steps", beacon(rise_u=0.9)).action
    assert "The fall was not seen" in judgement("steps", beacon(fall_u=0.9)).action
    assert "Still drifting 0.6 ppm/min" in judgement("drift", drift(0.998, 0.01)).action
    assert "Its offset walks" in judgement("drift", drift(0.7)).action


def test_enough_readings_and_few_false_alarms_recommend_nothing():
    assert "recommended" not in judgement("baseline", BaselineResult((ElementBaseline(5.0, 0.1, 5.2, 40, 31.0),), 1.0, 0)).found
    assert "recommended" not in judgement("bout_rule", bouts(0.01)).found


def test_few_innovations_say_little_of_the_gate():
    def word(rejected, innovations):
        return judgement("gated", evaluation(replace(FINDINGS, gated=rejected, innovations=innovations))).word

    assert [word(*of) for of in ((0, 9), (1, 9), (2, 9), (3, 9), (5, 9))] == ["PASS", "PASS", "WARN", "FAIL", "FAIL"]


def test_what_was_not_measured_is_not_judged():
    assert "drift" not in judged(warm_up()) and "delay" not in judged(beacon(delay_u_s=0.0))
    assert "safety" not in judged(beacon(guard=None)) and "streams" not in judged(beacon(due=0))
    assert "gas_range" not in judged(loaded(highest_ppm=None), search())
    assert "gated" not in judged(evaluation(replace(FINDINGS, innovations=0)))
    from_file = {"gas_range", "kept", "clocks", "streams", "safety"}
    assert set(judged(loaded(), search())) == from_file


def test_the_end_of_the_run_counts_not_that_of_the_calibration():
    ended = replace(search(), gaps=replace(STREAM, joints_after_s=3.0), guard=replace(GUARD, top_speed_m_s=0.9))
    found = judged(beacon(), ended)
    assert (found["streams"].word, found["safety"].word) == ("FAIL", "FAIL")


def test_what_did_not_run_is_not_judged():
    assert judge({}, STANDARD).word == "WARN" and judge({}, STANDARD).judgements == ()
    only = judge({BaselineResult: baseline()}, STANDARD)
    assert only.word == "PASS" and {j.name for j in only.judgements} == {"baseline"}


def test_without_readings_or_maps_nothing_is_consistent_or_inconsistent():
    nothing = evaluation(replace(FINDINGS, residuals=None, innovations=0), found=False, nis_mean=None, believed_m=None, sd_m=None)
    names = {j.name: j.word for j in judge({Evaluation: nothing}, STANDARD).judgements}
    assert names == {"observable": "PASS", "localised": "FAIL", "declared": "FAIL"}


def test_a_bearing_is_no_place():
    names = {j.name for j in judge({Evaluation: unseen(2)}, STANDARD).judgements}
    assert names.isdisjoint({"localised", "declared"}) and "observable" in names


def test_no_truth_enters_the_verdict():
    truths = {"source_error_m": 9.0, "nees_source": 1e6, "inside_95": False, "nose_error_m": 9.0, "bearing_error_deg": 99.0}
    assert judge({Evaluation: evaluation(**truths)}, STANDARD) == judge({Evaluation: evaluation()}, STANDARD)
    assert {field.name for field in fields(Findings)}.isdisjoint({"source_error_m", "nees_source", "inside_95", "bound_m", "outcome"})


def test_the_page_of_the_report_lists_every_criterion_with_what_it_is_about():
    page = (ROOT / "docs" / "how-to" / "report.md").read_text(encoding="utf-8")
    rows = dict(re.findall(r"^\| `(\w+)` \| (calibration|search) \|", page, re.MULTILINE))
    assert rows == {name: criterion.about for name, criterion in STANDARD.criteria.items()}


@pytest.mark.parametrize("seen_u", [0.0, 2.0])
def test_an_uncertainty_that_tells_nothing_apart_is_refused(seen_u):
    with pytest.raises(BadInput, match=r"Steps\.seen_u"):
        replace(STANDARD.criteria["steps"], seen_u=seen_u)
    with pytest.raises(BadInput, match="warns must hold all of passes"):
        replace(STANDARD.criteria["steps"], warns=(2.5, None))
