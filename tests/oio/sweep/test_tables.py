"""Tables of a sweep: groups, bootstrap intervals, pairs, the jobs to look at, and the files they are written to."""

import csv
import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oio.core.errors import BadInput
from oio.sweep.bootstrap import interval
from oio.sweep.compare import _differences, compare
from oio.sweep.group_table import HEADS, group_table
from oio.sweep.job_table import show_sweep
from oio.sweep.manifest import Job, Manifest, Outcome
from oio.sweep.records import records
from oio.sweep.sheet import save
from oio.sweep.worst import worst


def outcome(
    number, sensor="ec", seed=0, error=0.01, cold=0.02, inside=True, found=True, word="RIGHT", verdict="PASS", state="done", **words
):  # fmt: skip
    given = (f"sensor={sensor}", f"seed={seed}", *(f"{key.replace('__', '.')}={value}" for key, value in words.items()))
    job = Job(number, given, f"{number}_{sensor}_seed{seed}")
    scores = {"source_error_m": error, "inside_95": inside, "found": found, "sd_m": 0.01, "nees_source": 3.0}
    summary = {
        "schema": "x", "sensor": sensor, "dof": 5, "air": "still", "seed": seed, "calibrated": scores, "cold": {"source_error_m": cold},
        "calibration": {"time_s": 60.0, "u_a_ppm": 1.0}, "verdict": verdict, "scored": {"word": word}, "wall_s": number * 1.0,
    }  # fmt: skip
    return Outcome(job, state, None, summary if state == "done" else None)


def test_a_row_per_group_in_the_order_of_the_jobs():
    rows = records([outcome(0, "ndir", 0, 0.010), outcome(1, "ec", 0, 0.003), outcome(2, "ndir", 1, 0.030)])
    told = group_table(rows, None)
    assert [(row["sensor"], row["jobs"], row["median"], row["unit"]) for row in told] == [("ndir", 2, 20.0, "mm"), ("ec", 1, 3.0, "mm")]
    assert told[0]["median_low"] == 10.0 and told[0]["median_high"] == 30.0 and math.isnan(told[1]["median_low"])
    assert told[0]["beats"] == 0.5 and told[0]["inside_95"] == 1.0 and told[0]["calibration_s"] == 60.0


def test_failed_jobs_are_counted_and_not_averaged():
    told = group_table(records([outcome(0), outcome(1, state="failed")]), ["sensor"])
    assert (told[0]["jobs"], told[0]["failed"], told[0]["median"]) == (2, 1, 10.0)


def test_a_failed_job_is_counted_in_the_group_that_it_would_have_been_in():
    told = group_table(records([outcome(0), outcome(1, seed=1, state="failed"), outcome(2, "pa", state="failed")]), None)
    assert [(row["sensor"], row["dof"], row["air"], row["jobs"], row["failed"]) for row in told] == [
        ("ec", "5", "still", 2, 1), ("pa", "5", "still", 1, 1),
    ]  # fmt: skip


def test_jobs_are_shown_with_a_line_per_group_of_several(capsys):
    show_sweep([outcome(0), outcome(1, seed=1, error=0.03), outcome(2, "pa")], "somewhere")
    jobs, groups = capsys.readouterr().out.split("groups of several jobs; [low, high]")
    assert "cal. time [s]" in jobs and "2_pa_seed0" in jobs
    assert "20 [10, 30]" in groups and "pa" not in groups


def test_every_column_is_explained():
    (row,) = group_table(records([outcome(0)]), ["sensor"])
    assert {key.removesuffix("_low").removesuffix("_high") for key in row} - {"sensor"} == set(HEADS)


def test_groups_by_a_swept_key():
    rows = records([outcome(i, error=0.001 * (i + 1), stage__navigate__max_moves=10 * (1 + i // 2)) for i in range(4)])
    told = group_table(rows, ["stage.navigate.max_moves"])
    assert [(row["stage.navigate.max_moves"], row["median"]) for row in told] == [("10", 1.5), ("20", 3.5)]


def test_a_wrong_group_names_those_that_there_are():
    with pytest.raises(BadInput, match=r"grouped by .*sensor.* only"):
        group_table(records([outcome(0)]), ["calibrated.sd_m"])


def test_nothing_that_the_clock_decides_is_in_a_record():
    assert not any("wall" in key for key in records([outcome(0)])[0])


@given(st.lists(st.floats(0.1, 100.0), min_size=2, max_size=40))
def test_a_bootstrap_interval_holds_the_median_and_lies_within_the_data(values):
    data = np.array(values)
    low, high = interval(data, np.median)
    assert data.min() <= low <= np.median(data) <= high <= data.max()
    assert interval(data, np.median) == (low, high)


def test_a_bootstrap_interval_covers_as_often_as_it_says():
    rng = np.random.default_rng(3)
    held = 0
    for _ in range(300):
        low, high = interval(rng.normal(5.0, 1.0, 40), np.mean)
        held += low <= 5.0 <= high
    assert 0.90 <= held / 300 <= 0.98  # 95 %; the percentile bootstrap of 40 values is a little narrow


# ---- files


@pytest.mark.parametrize("kind", ["csv", "md", "tex", "parquet"])
def test_every_kind_of_file_holds_every_row(tmp_path, kind):
    if kind == "parquet":
        pytest.importorskip("pyarrow")
    rows = group_table(records([outcome(0, "ec"), outcome(1, "mox_mq")]), ["sensor"])
    path = tmp_path / f"table.{kind}"
    save(rows, path)
    if kind == "csv":
        read = list(csv.DictReader(path.read_text().splitlines()))
        assert [(row["sensor"], float(row["median"]), row["median_low"]) for row in read] == [("ec", 10.0, ""), ("mox_mq", 10.0, "")]
    elif kind == "parquet":
        import pyarrow.parquet

        assert pyarrow.parquet.read_table(path).column("sensor").to_pylist() == ["ec", "mox_mq"]
    else:
        text = path.read_text()
        assert "10" in text and ("mox\\_mq" if kind == "tex" else "mox_mq") in text and "nan" not in text


def test_files_are_never_overwritten_and_wrong_kinds_are_refused(tmp_path):
    (tmp_path / "a.csv").write_text("kept")
    with pytest.raises(BadInput, match="never overwritten"):
        save([{"a": 1}], tmp_path / "a.csv")
    with pytest.raises(BadInput, match=r"\.csv, \.parquet, \.md, \.tex"):
        save([{"a": 1}], tmp_path / "a.xls")
    with pytest.raises(BadInput, match="mkdir"):
        save([{"a": 1}], tmp_path / "no" / "a.csv")
    assert (tmp_path / "a.csv").read_text() == "kept"


# ---- pairs


def sweep_of(folder, outcomes, config="a: 1\nstage: {b: {a: 1}}\n"):
    """A sweep's folder with these outcomes."""
    folder.mkdir()
    for each in outcomes:
        path = folder / each.job.folder
        path.mkdir(parents=True)
        (path / "status.json").write_text(json.dumps({"state": each.state, "error": None}))
        (path / "summary.json").write_text(json.dumps(each.summary))
        (path / "config.yaml").write_text(config)
    Manifest(folder, "v", jobs=[each.job for each in outcomes]).write()
    return folder


def test_jobs_are_paired_by_case_and_seed_in_any_order(tmp_path):
    a = sweep_of(tmp_path / "a", [outcome(i, seed=i, error=0.01 * (i + 1)) for i in range(4)])
    b = sweep_of(tmp_path / "b", [outcome(3 - i, seed=i, error=0.02 * (i + 1)) for i in (3, 2, 1)], "a: 2\nstage: {b: {a: 2}}\n")
    told = compare(a, b)
    assert len(told.a) == 3 and told.unpaired == 1 and told.unit == "mm"
    assert told.ratio == pytest.approx(2.0) and told.ratio_interval == (pytest.approx(2.0), pytest.approx(2.0))
    assert told.differs == [("a", "1", "2")]  # the copy that a stage was given is not told again


def test_what_is_compared_is_not_paired_by(tmp_path):
    a = sweep_of(tmp_path / "a", [outcome(i, "ec", seed=i) for i in range(2)])
    b = sweep_of(tmp_path / "b", [outcome(i, "ndir", seed=i) for i in range(2)])
    assert "sensor" not in compare(a, b).paired_by and len(compare(a, b).a) == 2


def test_an_ambiguous_or_an_empty_comparison_is_refused(tmp_path):
    a = sweep_of(tmp_path / "a", [outcome(0, "ec", seed=0), outcome(1, "ndir", seed=0)])
    b = sweep_of(tmp_path / "b", [outcome(0, "pa", seed=0)])
    with pytest.raises(BadInput, match="not clear which to compare"):
        compare(a, b)
    failed = tmp_path / "c"
    sweep_of(failed, [])
    with pytest.raises(BadInput, match="no job that is done"):
        compare(failed, b)


def test_values_that_differ_in_several_ways(tmp_path):
    for name, value in (("a0", 1), ("a1", 2), ("b0", 3), ("b1", 4)):
        (tmp_path / name).mkdir()
        (tmp_path / name / "config.yaml").write_text(f"x: {value}\ny: 1\n")
    assert _differences([(tmp_path / "a0", tmp_path / "b0"), (tmp_path / "a1", tmp_path / "b1")]) == [("x", "(several)", "(several)")]


# ---- the jobs to look at


def test_the_most_alarming_come_first():
    rows = records([
        outcome(0), outcome(1, error=0.08, word="WRONG", found=False, verdict="WARN"), outcome(2, error=0.06, word="WRONG"),
        outcome(3, state="failed"), outcome(4, error=0.2, found=False),
    ])  # fmt: skip
    found = worst(rows, 10)
    assert [row["job"].split("_")[0] for row, _ in found] == ["3", "2", "1", "4"]
    assert "not done: failed" in found[0][1] and "declared" in found[1][1]
    assert len(worst(rows, 2)) == 2 and worst(records([outcome(0)]), 5) == []
