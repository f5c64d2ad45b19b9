"""A calibration that is kept is used again: to the last bit, only where it fits, and only as data."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml

from oio.log import MemoryLog
from oio.results.calibration import BaselineResult, Calibration
from oio.runtime.context import Context
from oio.runtime.runner import run_stages

pytestmark = pytest.mark.long

ROOT = Path(__file__).resolve().parents[1]
WORDS = ("sensor=mox_mics", "dof=3", "seed=4")
FEWER = ("stage.calibrate_bouts.moves_per_rung=2", "stage.map_beliefs.budget_s=0", "stage.map_beliefs.repeats=5")
CALIBRATE = ("stage=[warm_up,baseline,calibrate_bouts,map_beliefs,assemble_qr]", *FEWER)


class World:
    """A world in which a stage only asks for the time, and what it is."""

    sensor_serial = None  # nobody has told it in the run

    def __init__(self, started=None, devices=()):
        self.t_ns, self.made = 0, {"started": started, "devices": dict(devices)}


@pytest.fixture(scope="module")
def made(built, tmp_path_factory):
    """Results of the calibration stages, and the file that they leave."""
    out, words = tmp_path_factory.mktemp("made"), (*WORDS, *CALIBRATE)
    stages, backend, arm = built("stage", *words), built("backend", *words), built("arm", *words)
    with backend.open() as world:
        results = run_stages(stages, world, arm, MemoryLog(), out, 4)
    return results, out / "calibration.yaml"


def load(built, path, *words):
    return built("load_calibration", *WORDS, f"calibration={path}", *words)


def loaded(built, path, out, *words, fresh=None, world=None):
    """The calibration as a run would begin with it."""
    results = {} if fresh is None else {BaselineResult: fresh}
    return load(built, path, *words).run(Context(world or World(), MemoryLog(), np.random.default_rng(0), out, results))


def test_sensor_and_air_come_back_to_the_last_bit(built, made, tmp_path):
    results, path = made
    first, again = results[Calibration], loaded(built, path, tmp_path, "load_calibration.joints=kept", fresh=results[BaselineResult])
    lay = first.chosen.layout
    lasting = np.setdiff1d(np.arange(lay.size), np.arange(lay.size)[lay.baseline])
    for one, other in ((first.chosen, again.chosen), (first.paper, again.paper)):
        assert np.array_equal(one.mean[lasting], other.mean[lasting])
        assert np.array_equal(one.cov[np.ix_(lasting, lasting)], other.cov[np.ix_(lasting, lasting)])
        assert one.model == other.model and one.delay_s == other.delay_s
    figures = ("noise", "time_s", "error_ppm", "u_a_ppm", "u_b_m", "moves", "baselines")
    assert all(getattr(first, key) == getattr(again, key) or key == "baselines" for key in figures)
    assert [b.ppm for b in first.baselines] == [b.ppm for b in again.baselines]
    assert first.highest_ppm == again.highest_ppm and min(first.highest_ppm) > 1.0
    assert (tmp_path / "calibration.yaml").read_bytes() == path.read_bytes()


def test_encoders_and_offsets_are_open_again(built, made, tmp_path):
    results, path = made
    first, again = results[Calibration], loaded(built, path, tmp_path)
    lay = first.chosen.layout
    cold = again.cold_open
    for block in (lay.offset, lay.drift):
        assert np.array_equal(again.chosen.mean[block], cold.mean[block])
        assert np.allclose(again.chosen.cov[block, block], again.noise.inflation * cold.cov[block, block])
    assert np.array_equal(again.chosen.mean[lay.baseline], first.chosen.mean[lay.baseline])
    assert np.allclose(np.diag(again.chosen.cov)[lay.baseline], again.noise.inflation * np.diag(cold.cov)[lay.baseline])
    assert np.all(np.linalg.eigvalsh(again.chosen.cov) > 0)


def test_remarks_say_where_it_may_not_fit(built, made, tmp_path):
    results, path = made
    base = results[BaselineResult]
    assert loaded(built, path, tmp_path, fresh=base).kept.remarks == ()
    assert "no baseline was taken today" in loaded(built, path, tmp_path).kept.remarks[-1]
    assert loaded(built, path, tmp_path, "air=draft", fresh=base).kept.remarks == ("air was still and is draft now.",)
    bad = tmp_path / "bad.yaml"
    bad.write_text(path.read_text().replace("overall: PASS", "overall: FAIL"))
    assert loaded(built, bad, tmp_path, fresh=base).kept.remarks == ("its own verdict was FAIL.",)


def test_it_holds_for_one_serial_number(built, made, tmp_path):
    results, path = made
    base, told = results[BaselineResult], tmp_path / "told.yaml"
    assert yaml.safe_load(path.read_text())["holds_for"]["serial"] is None
    told.write_text(path.read_text().replace("serial: null", "serial: '17'"))
    assert loaded(built, told, tmp_path, "sensor_serial='17'", fresh=base).kept.remarks == ()
    unknown = loaded(built, told, tmp_path, fresh=base).kept.remarks
    assert unknown == ("it holds for sensor_serial=17 and this run has null.",)
    assert loaded(built, path, tmp_path, "sensor_serial='17'", fresh=base).kept.remarks[0].startswith("it holds for sensor_serial=null")
    with pytest.raises(Exception, match="holds for the sensor with serial number '17', but this run has sensor_serial='18'"):
        load(built, told, "sensor_serial='18'")


def test_age_and_devices_are_remarked_on(built, made, tmp_path):
    results, path = made
    base, old = results[BaselineResult], tmp_path / "old.yaml"
    document = yaml.safe_load(path.read_text())
    document["made"] = {"started": "2026-01-05T09:00:00+00:00", "devices": {"backend.nose": "SCD30 firmware 3.66", "backend.arm": None}}
    old.write_text(yaml.safe_dump(document))
    same = {"backend.nose": "SCD30 firmware 3.66", "backend.arm": None}
    remarks = loaded(built, old, tmp_path, fresh=base, world=World("2026-01-09T09:00:00+00:00", same)).kept.remarks
    assert remarks == ()
    remarks = loaded(built, old, tmp_path, fresh=base, world=World("2026-03-09T10:00:00+01:00", same)).kept.remarks
    assert remarks == ("it is 63 days old, 30 are good.",)
    (other,) = loaded(built, old, tmp_path, fresh=base, world=World(None, {**same, "backend.nose": "SCD30 firmware 4.0"})).kept.remarks
    assert "backend.nose 'SCD30 firmware 3.66' and are" in other and "firmware 4.0'" in other
    for i, bad in enumerate(("yesterday", "2026-01-05T09:00:00")):
        wrong = tmp_path / f"wrong{i}.yaml"
        wrong.write_text(yaml.safe_dump({**document, "made": {**document["made"], "started": bad}}))
        with pytest.raises(Exception, match="must be a time with its offset from UTC"):
            load(built, wrong)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("sensor=ndir",), "holds for sensor=mox_mics with 2 elements, but this run has sensor=ndir with 1"),
        (("dof=2",), "Type dof=3, or calibrate again"),
        (("range_law.r_ref_m=0.2",), "was made with range_law.r_ref_m=0.1, but this run has 0.2"),
        (("load_calibration.joints=perhaps",), "it can be nominal or kept"),
    ],
)
def test_what_does_not_fit_is_refused_before_anything_moves(built, made, words, says):
    with pytest.raises(Exception, match=says):
        load(built, made[1], *words)


@pytest.mark.parametrize(
    ("key", "value", "says"),
    [
        (("schema",), "oio.results.calibration/9", "has schema 'oio.results.calibration/9'"),
        (("fit", "mean"), [1.0], "fit.mean is [1.0], but it must be"),
        (("fit", "mean"), "os.system('x')", "must be a list"),
        (("fit", "cov"), [[1.0]], "fit.cov is [[1.0]]"),
        (("fit", "units"), ["mm"], "fit.units of the calibration is mm"),
        (("fit", "parameters"), ["x"], "fit.parameters of the calibration is x"),
        (("fit", "fluctuation", "gamma"), -1.0, "fit.fluctuation.gamma is -1.0, but it must be a finite number, 0 or more"),
        (("fit", "fluctuation", "scale"), float("nan"), "fit.fluctuation.scale is nan"),
        (("highest_ppm",), [1.0], "highest_ppm is [1.0], but it must be 2 finite numbers"),
        (("baselines",), [{"ppm": "5 ppm"}], "baselines[0].ppm is '5 ppm'"),
        (("assemblies", "gum", "measurements"), 2.5, "assemblies.gum.measurements is 2.5, but it must be a whole number"),
        (("totals",), None, "totals is None, but it must be a mapping"),
        (("verdict", "overall"), 7, "verdict.overall is 7, but it must be a text"),
        (("holds_for", "joints"), [1], "holds_for.joints is [1], but it must be a list of texts"),
    ],
)
def test_a_file_is_data_and_every_value_is_checked(built, made, tmp_path, key, value, says):
    document = yaml.safe_load(made[1].read_text())
    inner = document
    for name in key[:-1]:
        inner = inner[name]
    inner[key[-1]] = value
    (tmp_path / "bad.yaml").write_text(yaml.safe_dump(document))
    with pytest.raises(Exception, match=r"bad\.yaml|calibration") as refused:
        load(built, tmp_path / "bad.yaml")
    assert says in str(refused.value)


def test_aliases_are_refused_for_they_can_outgrow_any_memory(built, tmp_path):
    levels = "".join(f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]\n" for i in range(1, 40))
    (tmp_path / "bad.yaml").write_text(f"a0: &a0 [x]\n{levels}schema: *a39\n")
    with pytest.raises(Exception, match="has aliases"):
        load(built, tmp_path / "bad.yaml")


def test_a_covariance_that_is_none_is_refused(built, made, tmp_path):
    document = yaml.safe_load(made[1].read_text())
    document["fit"]["cov"][0][0] *= -1.0
    (tmp_path / "bad.yaml").write_text(yaml.safe_dump(document))
    with pytest.raises(Exception, match="must be a symmetric matrix without negative variances"):
        load(built, tmp_path / "bad.yaml")


def test_an_older_file_does_not_say_how_strong_its_gas_was(built, made, tmp_path):
    document = yaml.safe_load(made[1].read_text())
    del document["highest_ppm"]
    (tmp_path / "old.yaml").write_text(yaml.safe_dump(document))
    assert loaded(built, tmp_path / "old.yaml", tmp_path).highest_ppm is None


def test_an_older_file_knows_no_sway(built, made, tmp_path):
    document = yaml.safe_load(made[1].read_text())
    assert document["fit"]["fluctuation"]["sway"] == document["range_law"]["sway"]["value"] > 0.0
    del document["range_law"]["sway"], document["fit"]["fluctuation"]["sway"], document["fit"]["fluctuation"]["sway_s"]
    (tmp_path / "old.yaml").write_text(yaml.safe_dump(document))
    assert loaded(built, tmp_path / "old.yaml", tmp_path).chosen.model.fluctuation.sway == 0.0


def test_every_missing_key_is_named(built, made, tmp_path):
    document = yaml.safe_load(made[1].read_text())
    for name in ("schema", "holds_for", "fit", "assemblies", "baselines", "totals", "verdict", "paper_values", "made"):
        (tmp_path / "bad.yaml").write_text(yaml.safe_dump({k: v for k, v in document.items() if k != name}))
        with pytest.raises(Exception, match=f"has no key '{name}"):
            load(built, tmp_path / "bad.yaml")


def run(out, *words):
    line = [sys.executable, "-m", "oio.run", *WORDS, *words, "report=false", f"hydra.run.dir={out}"]
    return subprocess.run(line, cwd=ROOT, capture_output=True, text=True, timeout=300, check=False)


def test_a_run_begins_with_it_and_its_log_is_replayed(made, tmp_path):
    few = ("stage.navigate.max_moves=8", "stage=[navigate,evaluate]")
    done = run(tmp_path / "run", f"calibration={made[1]}", *few)
    assert done.returncode in (0, 3), done.stderr
    assert f"calibration of {made[1]}:" in done.stdout and "kept" in done.stdout
    first = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert {"gas_range", "safety", "streams", "gated"} <= {c["name"] for c in first["criteria"]}
    assert {"steps", "bout_detection", "delay", "repeats"}.isdisjoint({c["name"] for c in first["criteria"]})
    assert first["calibration"]["kept"]["file"] == str(made[1]) and first["calibrated"]["moves"] == 8
    log = tmp_path / "run" / "run.mcap"
    again = run(tmp_path / "again", "backend=replay", f"backend.log={log}", "stage=[navigate,evaluate]")
    assert again.returncode in (0, 3), again.stderr
    second = json.loads((tmp_path / "again" / "summary.json").read_text())
    assert second["calibrated"] == first["calibrated"] and second["criteria"] == first["criteria"]


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ((), "the stages map_beliefs, assemble_qr make one. Type stage=[navigate,evaluate]"),
        (("stage=[navigate,evaluate]", "calibration=nowhere.yaml"), "calibration=nowhere.yaml was given, but there is no such file"),
        (("stage=[navigate,evaluate]", "+calibration=x.yaml"), "calibration"),
        (
            ("stage=[navigate,evaluate]", "sensor_serial=1e5"),
            "sensor_serial=100000.0 was given, but it must be a text, or null. Put it in quotes",
        ),
    ],
)
def test_wrong_input_ends_in_one_paragraph(made, tmp_path, words, says):
    given = () if any("calibration=" in word for word in words) else (f"calibration={made[1]}",)
    done = run(tmp_path / "run", *given, *words)
    assert done.returncode == 2 and says in done.stderr and done.stderr.count("\n") == 1
    assert not (tmp_path / "run").exists()


def test_what_ends_with_the_baseline_leaves_it(made, tmp_path):
    done = run(tmp_path / "run", "stage=[warm_up,baseline]", "sensor_serial=12")
    assert done.returncode == 0 and "baseline" in done.stdout
    left = yaml.safe_load((tmp_path / "run" / "calibration.yaml").read_text())
    entry = left["sensor"]["element_0"]["baseline"]
    assert left["holds_for"]["serial"] == "12" == json.loads((tmp_path / "run" / "summary.json").read_text())["sensor_serial"]
    assert left["made"] == {"started": None, "devices": {}}  # of a simulation
    assert left["schema"] == "oio.results.baseline/1" and entry["unit"] == "ppm" and entry["u"] > 0
    refused = run(tmp_path / "next", "stage=[navigate,evaluate]", f"calibration={tmp_path / 'run' / 'calibration.yaml'}")
    assert refused.returncode == 2 and "a run can begin with oio.results.calibration/1 alone" in refused.stderr
