"""Laws of comparing calibrations: with itself zero, swapped a change of sign, one specimen agrees, another differs."""

import contextlib
import copy
import json
import random

import numpy as np
import pytest
import yaml
from scipy import stats

from oio.compare.__main__ import main
from oio.compare.comparison import compare
from oio.compare.verdict import verdict
from oio.core.errors import BadInput

JUDGED = ("sensor", "arm")
ALL = (*JUDGED, "range_law")


def test_with_itself_everything_is_zero(specimen, entries):
    made = specimen().calibrated(np.random.default_rng(0))
    found = compare([entries(made), entries(made)], ALL)
    assert found.chi2 == 0.0 and all(row.sd == 0.0 and row.size == 0.0 for row in found.rows)
    assert found.agree and verdict(found) == "agree within their uncertainty (sensor and arm and range_law)."


def test_swapping_changes_signs_alone(specimen, entries):
    rng = np.random.default_rng(1)
    a, b = (entries(specimen().calibrated(rng)) for _ in range(2))
    one, other = compare([a, b], ALL), compare([b, a], ALL)
    assert [row.sd for row in one.rows] == pytest.approx([-row.sd for row in other.rows])
    assert (one.chi2, one.dof, one.p) == pytest.approx((other.chi2, other.dof, other.p))


def test_chi_square_is_that_of_one_specimen(specimen, entries):
    """Errors drawn from the covariance that the files state: p is uniform over what was fitted together."""
    rng, made, p = np.random.default_rng(2), specimen(), []
    for _ in range(30):
        pair = [made.calibrated(rng) for _ in range(2)]
        for element in ("element_0", "element_1"):
            for document in pair:
                document["sensor"][element] = {"gain": document["sensor"][element]["gain"]}
        found = compare([entries(document) for document in pair], ALL)
        p.append(found.p)
    assert found.dof == 5 + 4 + 1 + 1  # law, joints, gain, lag
    assert stats.kstest(p, "uniform").pvalue > 0.01


def test_the_covariance_counts(specimen, entries):
    """Along what cannot be told apart a difference is none; across it is one, though neither joint's is large by itself."""
    made = specimen(correlation=0.0)
    made.cov[9, 10] = made.cov[10, 9] = 0.999 * np.sqrt(made.cov[9, 9] * made.cov[10, 10])  # the offsets of both joints
    known = made.calibrated(None)
    for sign in (1, -1):
        other = made.calibrated(None)
        for joint, way in (("pan", 1), ("tilt", sign)):
            offset = other["arm"][joint]["offset"]
            offset["value"] += way * 2.5 * offset["u"]
        found = compare([entries(known), entries(other)], JUDGED)
        assert not found.flagged and found.agree == (sign == 1)
    assert "all together, chi-square" in verdict(found)


def test_without_the_matrix_quantities_are_summed_one_by_one(specimen, entries):
    rng = np.random.default_rng(3)
    a, b = specimen().calibrated(rng), specimen().calibrated(rng)
    for document in (a, b):
        del document["filter"]["P0_prior_parameters"]
    found = compare([entries(a), entries(b)], JUDGED)
    assert found.dof == 4 + 1 + 1 + 1 + 2  # joints, gain, lag, white noise, offsets


def test_another_gain_differs_and_is_named(specimen, entries):
    made = specimen().calibrated(None)
    other = entries(made, "friday", sensor__element_1__gain={**made["sensor"]["element_1"]["gain"], "value": 1.5})
    found = compare([entries(made), other], JUDGED)
    assert [row.key for row in found.flagged] == ["sensor.element_1.gain"]
    assert verdict(found).startswith("differ: sensor.element_1.gain by ") and "Calibrate again, or find what changed." in verdict(found)


def test_what_follows_from_others_decides_nothing(specimen, entries):
    made = specimen().calibrated(None)
    other = entries(made, sensor__error={**made["sensor"]["error"], "value": 5.0}, type_b__rms={**made["type_b"]["rms"], "value": 1.0})
    assert compare([entries(made), other], ALL).agree


def test_another_air_is_said_and_decides_if_it_is_asked_to(specimen, entries):
    made = specimen().calibrated(None)
    other = entries(made, range_law__wind_x={**made["range_law"]["wind_x"], "value": 9.0}, range_law__air="isotropic")
    found = compare([entries(made), other], JUDGED)
    assert found.agree and "Not judged: air form is all against isotropic; range_law.wind_x by" in verdict(found)
    assert not compare([entries(made), other], ALL).agree


def test_another_sensor_decides_and_another_air_is_said(specimen, entries):
    made = specimen().calibrated(None)
    one, other = (entries(made, holds_for={"sensor": sensor, "air": air}) for sensor, air in (("ec", "still"), ("ndir", "draft")))
    found = compare([one, other], JUDGED)
    assert found.facts == ("sensor is ec against ndir",) and found.remarks == ("air is still against draft",)
    assert "differ: sensor is ec against ndir." in verdict(found) and "Not judged: air is still against draft" in verdict(found)


def test_few_degrees_of_freedom_need_more(specimen, entries):
    """An offset of 4 readings is not flagged at 3.2 sd, one of 100 is."""
    made = specimen().calibrated(None)
    for dof, flagged in ((3.0, False), (100.0, True)):
        one = {"value": 0.0, "u": 1.0, "unit": "ppm", "dof": dof}
        other = {**one, "value": 4.53}  # 3.2 sd of the difference
        pair = [entries(made, sensor__element_0__baseline=each) for each in (one, other)]
        assert bool(compare(pair, JUDGED).flagged) == flagged


def test_what_was_taken_as_known_is_a_fact(specimen, entries):
    made = specimen().calibrated(None)
    found = compare([entries(made), entries(made, sensor__delay={**made["sensor"]["delay"], "value": 0.2})], JUDGED)
    assert found.facts == ("sensor.delay is taken as known: 0 against 0.2 s",) and not found.agree


def test_other_parts_are_named(specimen, entries):
    made = specimen().calibrated(None)
    other = specimen().calibrated(None)
    other["arm"]["roll"] = other["arm"].pop("tilt")
    other["filter"]["assembly"] = "paper"
    found = compare([entries(made), entries(other)], JUDGED)
    assert found.facts[:2] == ("assembly is gum against paper", "joints is pan, tilt against pan, roll")
    assert "arm.roll.offset is not in all of them" in found.facts and "arm.tilt.drift is not in all of them" in found.facts


def test_other_units_are_refused(specimen, entries):
    made = specimen().calibrated(None)
    other = entries(made, "friday", sensor__element_0__baseline={"value": 2000.0, "u": 1.0, "unit": "ppb"})
    with pytest.raises(BadInput, match=r"sensor\.element_0\.baseline is in ppm in monday, but in ppb in friday"):
        compare([entries(made), other], JUDGED)


@pytest.mark.parametrize("matrix", [[["a"]], [[float("nan")]], None, 3, "no covariance"])
def test_a_matrix_that_is_no_covariance(specimen, entries, matrix):
    made = specimen().calibrated(None)
    if matrix == "no covariance":
        matrix = (-np.array(made["filter"]["P0_prior_parameters"])).tolist()
    other = entries(made, filter__P0_prior_parameters=matrix)
    if matrix in (None, 3):
        assert compare([other, other], JUDGED).agree
        return
    with pytest.raises(BadInput, match=r"filter\.P0_prior_parameters must be a"):
        compare([other, other], JUDGED)


def test_a_week_of_calibrations(specimen, entries):
    made = specimen()
    rng = np.random.default_rng(4)
    week = [made.calibrated(rng) for _ in range(4)]
    assert compare([entries(each) for each in week], ALL).agree
    for day, each in enumerate(week):
        each["sensor"]["element_1"]["gain"]["value"] *= 1.05**day
    found = compare([entries(each) for each in week], JUDGED)
    (row,) = found.flagged
    assert row.key == "sensor.element_1.gain" and row.sd > 5.0
    assert "sensor.element_1.gain by chi-square" in verdict(found)


@pytest.fixture
def files(tmp_path, specimen):
    """Paths of calibrations: monday, friday of the same specimen, other of another."""
    rng = np.random.default_rng(5)
    for name, seed in (("monday", 0), ("friday", 0), ("other", 1)):
        made = specimen()
        made.theta[14] += seed
        (tmp_path / f"{name}.yaml").write_text(yaml.safe_dump(made.calibrated(rng)), encoding="utf-8")
    return [str(tmp_path / f"{name}.yaml") for name in ("monday", "friday", "other")]


def test_the_command(files, capsys):
    monday, friday, other = files
    assert main([monday, friday]) == 0
    said = capsys.readouterr().out
    assert "agree within their uncertainty (sensor and arm)." in said and "A: " in said
    assert all(len(line.rstrip()) <= 80 for line in said.splitlines() if not line.startswith(("A:", "B:")))
    assert main([monday, other, "--sort", "section"]) == 3
    assert "differ: sensor.element_1.gain by " in " ".join(capsys.readouterr().out.split())
    assert main([monday, friday, other]) == 3


def test_the_command_writes_what_it_says(files, tmp_path, capsys):
    for suffix in ("csv", "json", "md"):
        assert main([*files[:2], "--out", str(tmp_path / f"out.{suffix}")]) == 0
    document = json.loads((tmp_path / "out.json").read_text())
    assert document["schema"] == "oio.compare/1" and document["agree"] is True
    heads, *rows = (tmp_path / "out.csv").read_text().splitlines()
    assert heads == "quantity,unit,value_A,value_B,u_A,u_B,difference,difference_sd,chi2,p,counted,flagged"
    assert len(rows) == len(document["quantities"])
    first = document["quantities"][0]
    assert first["difference"] == first["value_B"] - first["value_A"]
    assert "| sensor.tau_rise | s |" in (tmp_path / "out.md").read_text()
    assert main([*files[:2], "--out", str(tmp_path / "out.csv")]) == 2
    assert "is there already" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["{0}"], "two or more are compared"),
        (["{0}", "nowhere"], "there is no such file"),
        (["{0}", "{1}", "--out", "table.xlsx"], "it ends in .csv, .json, .md. Type e.g. --out table.csv"),
        (["{0}", "{1}", "--out", "nowhere/table.csv"], "mkdir -p nowhere"),
        (["{0}", "{1}", "--judge", "type_a"], "--judge has type_a, but it can have sensor, range_law, arm"),
    ],
)
def test_bad_input(files, capsys, words, said):
    assert main([word.format(*files) for word in words]) == 2
    shown = capsys.readouterr()
    assert said in shown.err and shown.err.count("\n") == 1 and shown.out == ""


def test_calibrations_without_a_quantity_are_refused(entries):
    empty = {"schema": "oio.results.calibration/1", "sensor": {"a": 1}, "range_law": {"air": "all"}, "arm": {"pan": 1}}
    with pytest.raises(BadInput, match="monday shares no quantity"):
        compare([entries(empty), entries(empty)], JUDGED)


def places(node, path=()):
    """Every place in a document."""
    for key, value in node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ():
        yield (*path, key)
        yield from places(value, (*path, key))


@pytest.mark.parametrize("seed", range(25))
def test_a_spoilt_file_is_compared_or_refused(specimen, entries, seed):
    made = specimen().calibrated(None)
    rng = random.Random(seed)
    spoilt = copy.deepcopy(made)
    *way, last = rng.choice([place for place in places(made) if place[:2] != ("filter", "P0_prior_parameters") or rng.random() < 0.05])
    node = spoilt
    for key in way:
        node = node[key]
    node[last] = rng.choice([None, 0, -1, 1e300, 1e-300, float("nan"), "x", True, [], {}, {"value": 1}])
    with contextlib.suppress(BadInput):
        other = entries(spoilt, "friday")
        for calibrations in ([entries(made), other], [other, entries(made)], [entries(made), other, entries(made)]):
            assert verdict(compare(calibrations, ALL)).startswith(("agree", "differ"))
