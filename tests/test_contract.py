"""What a run leaves behind, and that the same log or the same seed gives the same bits: the promises that other tools build on."""

import json
import signal
import subprocess
import sys
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
import yaml
from hydra.core.global_hydra import GlobalHydra
from mcap.reader import make_reader

from oio.cli import run
from oio.core.records import Event, GasSample, JointState, Truth
from oio.log import (
    read_attachment,
    read_beliefs,
    read_end,
    read_filter_estimates,
    read_innovations,
    read_metadata,
    read_odometry,
    read_readings,
    read_samples,
    read_stages,
    read_states,
)
from oio.runtime.runner import check_order

pytestmark = pytest.mark.long

ROOT = Path(__file__).resolve().parents[1]
REPEATS = ("stage.map_beliefs.repeats=2", "stage.map_beliefs.budget_s=0")
FEWER = ("stage.navigate.max_moves=8", "stage.calibrate_bouts.moves_per_rung=2", *REPEATS)
TINY = ("sensor=ndir", "dof=3", "seed=3", *FEWER)
STAGES = ["warm_up", "baseline", "calibrate_bouts", "map_beliefs", "assemble_qr", "navigate", "evaluate"]

IDENTITY = {"sensor", "profile", "dof", "backend", "air", "world", "ekf", "assembly", "seed"}
VARIANTS = ["cold", "cold_open", "calibrated", "calibrated_paper_assembly"]
SUMMARY = IDENTITY | {
    *("schema", "source_position_m", "calibration", *VARIANTS, "dead_reckoning", "bound_m", "bound_ratio"),
    *("posterior_bound_m", "posterior_bound_ratio"),
    *("verdict", "verdicts", "reasons", "criteria", "scored", "reproducible", "protocol", "simulated_s", "wall_s", "sensor_serial"),
}
OUTCOME = {
    *("source_error_m", "nose_error_m", "nees_source", "inside_95", "nis_mean", "moves", "time_s", "found"),
    *("final_nose_to_source_m", "believed_m", "sd_m", "filtered_error_m", "filtered_nees", "world", "other_places"),
}


class Left:
    """A run's directory, and what its command said."""

    def __init__(self, path, code=0, stdout="", stderr=""):
        self.path, self.code, self.stdout, self.stderr = path, code, stdout, stderr
        self.log = path / "run.mcap"

    def json(self, name):
        return json.loads((self.path / name).read_text(encoding="utf-8"), parse_constant=pytest.fail)

    def yaml(self, name):
        return yaml.safe_load((self.path / name).read_text(encoding="utf-8"))

    @property
    def summary(self):
        return self.json("summary.json")


def command(out, *words):
    """The command as a person types it."""
    line = [sys.executable, "-m", "oio.run", *words, "report=false", f"hydra.run.dir={out}"]
    done = subprocess.run(line, cwd=ROOT, capture_output=True, text=True, timeout=300, check=False)
    return Left(out, done.returncode, done.stdout, done.stderr)


def within(out, *words):
    """The same in this process, which has imported everything already."""
    handler, exit_code = signal.getsignal(signal.SIGTERM), 0
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(ROOT)
        patch.setenv("HYDRA_FULL_ERROR", "1")
        patch.setattr(sys, "argv", ["oio.run", *words, f"hydra.run.dir={out}"])
        patch.setattr(sys, "path", list(sys.path))
        patch.setattr(run, "FAILED", [])
        GlobalHydra.instance().clear()
        try:
            run.main()
        except SystemExit as ended:
            exit_code = ended.code
        finally:
            signal.signal(signal.SIGTERM, handler)
            GlobalHydra.instance().clear()
    return Left(out, exit_code)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """One small run of everything, in a process of its own."""
    return command(tmp_path_factory.mktemp("runs") / "made", *TINY)


@pytest.fixture(scope="module")
def replayed(made, tmp_path_factory):
    return command(tmp_path_factory.mktemp("runs") / "replayed", "backend=replay", f"backend.log={made.log}")


@pytest.fixture(scope="module")
def bandit(tmp_path_factory):
    """The bandit goes where bouts are, whatever the filter believes: every filter can be replayed on its log."""
    return within(tmp_path_factory.mktemp("runs") / "bandit", *TINY, "search=bandit")


@pytest.fixture(scope="module")
def bearing(tmp_path_factory):
    return within(tmp_path_factory.mktemp("runs") / "bearing", "sensor=ndir", "dof=1", "seed=3", *FEWER)


def same(a, b):
    return a.t_ns == b.t_ns and all(
        np.array_equal(getattr(a, key), getattr(b, key)) for key in ("mean", "residual", "cov") if hasattr(a, key)
    )


def assert_same_bits(first, second, read):
    a, b = list(read(first.log)), list(read(second.log))
    assert a and len(a) == len(b)
    assert all(same(x, y) for x, y in zip(a, b, strict=True))


def without(document, *keys):
    return {key: value for key, value in document.items() if key not in keys}


# ---- the files


def test_it_ends_well_and_quietly(made):
    assert (made.code, made.stderr) == (0, "")
    for word in (
        "cold start",
        "cold start, open",
        "from what a bench can see",
        "scored",
        "calibrated",
        "with the paper's Q, R",
        "dead reckoning",
        "error / bound",
        "Cramer-Rao",
        "verdict",
    ):
        assert word in made.stdout
    assert str(made.path) in made.stdout.splitlines()[-1]
    assert "\x1b" not in made.stdout


def test_the_files_and_no_others(made):
    names = {path.name for path in made.path.iterdir()}
    assert names == {"run.mcap", "calibration.yaml", "config.yaml", "status.json", "summary.json"}


def test_the_status_is_done(made):
    status = made.json("status.json")
    assert abs(datetime.now(UTC) - datetime.fromisoformat(status.pop("started"))) < timedelta(hours=3)
    assert status == {"state": "done", "error": None, "traceback": None}


def test_the_config_is_whole_and_as_typed(made):
    config = made.yaml("config.yaml")
    assert (config["sensor"]["name"], config["dof"], config["seed"]) == ("ndir", 3, 3)
    assert list(config["stage"]) == STAGES
    assert config["stage"]["navigate"]["max_moves"] == 8
    assert "${" not in (made.path / "config.yaml").read_text(encoding="utf-8")


# ---- summary.json


def test_the_summary_has_its_schema(made):
    summary = made.summary
    assert summary["schema"] == "oio.results.summary/2"
    assert set(summary) == SUMMARY
    assert set(summary["calibration"]) == {"time_s", "error_ppm", "u_a_ppm", "u_b_m", "moves"}
    assert set(summary["dead_reckoning"]) == {"nose_error_m"}
    for name in VARIANTS:
        assert set(summary[name]) == OUTCOME


def test_the_summary_says_what_was_run(made):
    expected = {
        "sensor": "ndir",
        "profile": "paper",
        "dof": 3,
        "backend": "mujoco",
        "air": "still",
        "world": "unchanged",
        "ekf": "ekf",
        "assembly": "gum",
        "seed": 3,
    }
    assert {key: made.summary[key] for key in IDENTITY} == expected


def test_the_figures_are_of_their_kind(made):
    summary = made.summary
    assert summary["verdict"] in ("PASS", "WARN", "FAIL")
    assert all(isinstance(reason, str) and reason.endswith(".") for reason in summary["reasons"])
    assert (summary["verdict"] == "PASS") == (not summary["reasons"])
    assert summary["scored"]["word"] in ("RIGHT", "WRONG") and all(reason.endswith(".") for reason in summary["scored"]["reasons"])
    assert len(summary["source_position_m"]) == 3
    assert summary["wall_s"] > 0 and summary["bound_m"] > 0 and summary["bound_ratio"] > 0 and summary["dead_reckoning"]["nose_error_m"] > 0
    assert all(summary["calibration"][key] > 0 for key in ("time_s", "error_ppm", "u_a_ppm", "u_b_m"))
    for name in VARIANTS:
        outcome = summary[name]
        assert isinstance(outcome["inside_95"], bool) and isinstance(outcome["found"], bool)
        assert 1 <= outcome["moves"] <= 8 and 0 < outcome["time_s"] < summary["simulated_s"]
        assert outcome["nees_source"] >= 0 and outcome["nose_error_m"] > 0 and len(outcome["believed_m"]) == 3
        for place in outcome["other_places"]:
            assert set(place) == {"believed_m", "sd_m", "world", "nees_source"} and len(place["believed_m"]) == 3
            assert place["sd_m"] > 0 and place["nees_source"] >= 0
            assert np.linalg.norm(np.array(place["believed_m"]) - outcome["believed_m"]) > 0.02  # else it would be the same place


def test_the_errors_are_those_of_the_believed_place(made):
    summary = made.summary
    for name in VARIANTS:
        missed = np.linalg.norm(np.array(summary[name]["believed_m"]) - summary["source_position_m"])
        assert summary[name]["source_error_m"] == pytest.approx(missed, rel=1e-9)


def test_moves_are_counted(made):
    """Three rungs of two moves, two repeats of five measurements."""
    assert made.summary["calibration"]["moves"] == 3 * 2 + 2 * 5


# ---- calibration.yaml


def quantities(node, path=""):
    if isinstance(node, dict):
        if "value" in node:
            yield path, node
        else:
            for key, inner in node.items():
                yield from quantities(inner, f"{path}.{key}")
    elif isinstance(node, list):
        for i, inner in enumerate(node):
            yield from quantities(inner, f"{path}[{i}]")


def test_every_quantity_has_value_uncertainty_unit_freedom_and_method(made):
    document = made.yaml("calibration.yaml")
    assert document["schema"] == "oio.results.calibration/1"
    found = dict(quantities(without(document, "paper_values", "verdict")))
    assert len(found) > 15
    for path, quantity in found.items():
        assert set(quantity) == {"value", "u", "unit", "dof", "method"}, path
        assert quantity["method"] in ("A", "B"), path
        assert quantity["u"] >= 0 and np.isfinite(quantity["value"]) and isinstance(quantity["unit"], str), path
        assert quantity["dof"] is None or quantity["dof"] >= 0, path
        assert (quantity["method"] == "B") == (quantity["dof"] is None), path
    for name in (".sensor.element_0.baseline", ".sensor.tau_rise", ".range_law.exponent", ".arm.shoulder_azimuth.offset", ".type_b.rms"):
        assert name in found


def test_q_r_and_p0_are_there(made):
    filter_ = made.yaml("calibration.yaml")["filter"]
    n = len(filter_["states"])
    assert filter_["assembly"] == "gum"
    assert len(filter_["units"]) == len(filter_["Q_per_s_diagonal"]) == n
    assert min(filter_["Q_per_s_diagonal"]) >= 0
    assert filter_["R_clean_air_ppm2"][0][0] > 0
    assert np.shape(filter_["P0_source_added_m2"]) == (3, 3)
    p0 = np.array(filter_["P0_prior_parameters"])
    np.testing.assert_allclose(p0, p0.T, rtol=1e-9, atol=1e-18)
    assert np.linalg.eigvalsh(p0).min() > -1e-12


def test_the_papers_two_uncertainties_are_those_of_the_summary(made):
    paper, calibration = made.yaml("calibration.yaml")["paper_values"], made.summary["calibration"]
    assert paper == {"u_a": {"value": calibration["u_a_ppm"], "unit": "ppm"}, "u_b": {"value": calibration["u_b_m"], "unit": "m"}}


def test_a_rung_of_the_ladder_each(made):
    rungs = made.yaml("calibration.yaml")["type_a"]
    assert [(rung["rung"], rung["window"], rung["moves"]) for rung in rungs] == [(1, 3, 2), (2, 5, 2), (3, 7, 2)]


# ---- run.mcap


def test_the_topics(made):
    with made.log.open("rb") as file:
        seen = make_reader(file).get_summary()
    counts = {channel.topic: seen.statistics.channel_message_counts.get(channel.id, 0) for channel in seen.channels.values()}
    topics = ["/arm/joint_states", "/gas/ndir/sample", "/gas/ndir/reading", "/estimate/state", "/estimate/odom", "/estimate/innovation"]
    topics += [
        "/arm/scene",
        "/belief/scene",
        "/estimate/tf",
        "/evaluate/cold",
        "/evaluate/cold_open",
        "/events",
        "/log",
        "/tf",
        "/truth/state",
        "/truth/nose",
        "/truth/scene",
        *(f"/stage/{name}" for name in STAGES),
    ]
    assert set(topics) <= set(counts)
    assert min(counts[topic] for topic in topics) > 0
    assert all(counts[f"/stage/{name}"] == 2 for name in STAGES)
    assert counts["/gas/ndir/sample"] == counts["/gas/ndir/reading"]


def test_the_metadata_tells_what_it_was(made):
    about = read_metadata(made.log)
    assert about["schema_version"] == "1"
    assert {key: about[key] for key in IDENTITY} == {key: str(made.summary[key]) for key in IDENTITY}
    assert about["config"] == (made.path / "config.yaml").read_text(encoding="utf-8")
    assert json.loads(about["overrides"]) == [*TINY, "report=false"]
    versions = json.loads(about["versions"])
    assert {"oio", "python", "numpy", "scipy", "mujoco", "filterpy", "mcap"} <= set(versions)
    assert versions["numpy"] == np.__version__
    assert about["git"]
    assert len(about["joints"].split()) == 3


def test_the_attachments(made):
    for name in ("config.yaml", "calibration.yaml"):
        assert read_attachment(made.log, name) == (made.path / name).read_bytes()
    assert read_attachment(made.log, "arm.mjcf") == (ROOT / "hardware" / "arms" / "so101.xml").read_bytes()


def test_stages_begin_and_end_in_order(made):
    told = [(stage, state) for _, stage, state in read_stages(made.log)]
    assert told == [(name, state) for name in STAGES for state in ("begin", "end")]
    times = [t_ns for t_ns, _, _ in read_stages(made.log)]
    assert times == sorted(times)


def test_samples_are_in_time_order_and_whole(made):
    samples = list(read_samples(made.log))
    for kind in (JointState, GasSample, Truth):
        times = [sample.t_ns for sample in samples if isinstance(sample, kind)]
        assert times and times == sorted(set(times))
    assert all(sample.q.shape == (3,) for sample in samples if isinstance(sample, JointState))
    assert read_end(made.log) / 1e9 == pytest.approx(made.summary["simulated_s"])


def test_every_raw_sample_has_its_reading(made):
    raw = [(s.t_ns, s.element) for s in read_samples(made.log) if isinstance(s, GasSample)]
    assert raw == [(r.t_ns, r.element) for r in read_readings(made.log)]


def test_beliefs_are_whole_and_their_states_are_named(made):
    states = list(read_states(made.log))
    names = made.yaml("calibration.yaml")["filter"]["states"]
    assert len(states) > 5
    for told, belief in states:
        assert list(told) == names
        np.testing.assert_array_equal(belief.cov, belief.cov.T)
        assert np.all(np.isfinite(belief.mean)) and np.all(np.diag(belief.cov) >= 0)
    assert len(list(read_odometry(made.log))) >= len(states)


def test_the_last_belief_is_what_the_summary_scores(made):
    """The summary reruns the filter over the log; the search did so live: one and the same."""
    names, belief = list(read_states(made.log))[-1]
    place = [belief.mean[names.index(f"source_{axis}")] for axis in "xyz"]
    np.testing.assert_allclose(place, made.summary["calibrated"]["believed_m"], rtol=0, atol=1e-12)


def test_the_innovations_give_the_mean_nis(made):
    nis = [innovation.nis for innovation in read_innovations(made.log) if not innovation.gated]
    assert np.mean(nis) == pytest.approx(made.summary["calibrated"]["nis_mean"], rel=1e-9)


def test_the_last_estimates_of_the_cold_starts_are_what_the_summary_scores(made):
    last = {one.variant: one for one in read_filter_estimates(made.log)}
    assert set(last) == {"cold", "cold_open"}
    for name, one in last.items():
        assert one.source_m.tolist() == made.summary[name]["believed_m"]
        assert np.sqrt(np.trace(one.source_cov)) == made.summary[name]["sd_m"]


def test_the_nose_of_a_cold_start_is_logged_at_stamps_of_the_truth(made):
    """All but that of a map, which may come between two of them."""
    truths = {sample.t_ns: sample.nose_m for sample in read_samples(made.log) if isinstance(sample, Truth)}
    for name in ("cold", "cold_open"):
        logged = [one for one in read_filter_estimates(made.log) if one.variant == name]
        errors = [np.linalg.norm(one.nose_m - truths[one.t_ns]) for one in logged if one.t_ns in truths]
        assert len(errors) > 0.7 * len(logged) > 3
        # twice a second, of the hundreds of instants that the summary averages over
        assert np.sqrt(np.mean(np.square(errors))) == pytest.approx(made.summary[name]["nose_error_m"], rel=0.25)


# ---- the same again


@pytest.mark.parametrize("read", [read_beliefs, read_innovations, read_filter_estimates])
def test_a_replay_gives_every_bit_again(made, replayed, read):
    assert (replayed.code, replayed.stderr) == (0, "")
    assert_same_bits(made, replayed, read)


def test_a_replay_needs_no_other_word_than_the_log(made, replayed):
    """Overrides come from the log."""
    assert replayed.yaml("config.yaml")["stage"] == made.yaml("config.yaml")["stage"]


def test_a_replay_has_the_account_of_the_guard_that_moved_the_arm(made, replayed):
    accounts = [[e.text for e in read_samples(run.log) if isinstance(e, Event) and e.kind == "guard"] for run in (made, replayed)]
    assert len(accounts[0]) == 2 and accounts[0] == accounts[1]  # at the end of calibration and search
    assert {"safety", "steps", "bout_detection", "streams", "gas_range", "gated"} <= {c["name"] for c in replayed.summary["criteria"]}


def test_a_replay_calibrates_and_scores_the_same(made, replayed):
    assert replayed.yaml("calibration.yaml") == made.yaml("calibration.yaml")
    assert replayed.summary["backend"] == "replay"
    assert replayed.summary["world"] is None  # which world was simulated only the log's own run knows
    assert without(replayed.summary, "backend", "world", "wall_s") == without(made.summary, "backend", "world", "wall_s")


def test_the_same_seed_gives_the_same_run_in_another_process(made, tmp_path):
    again = within(tmp_path / "again", *TINY)
    assert again.code == 0
    assert_same_bits(made, again, read_beliefs)
    assert_same_bits(made, again, read_innovations)
    assert without(again.summary, "wall_s") == without(made.summary, "wall_s")
    assert (again.path / "calibration.yaml").read_bytes() == (made.path / "calibration.yaml").read_bytes()


@pytest.mark.slow
def test_another_seed_is_another_run(made, tmp_path):
    other = within(tmp_path / "other", *TINY, "seed=4")
    assert other.summary["source_position_m"] != made.summary["source_position_m"]


# ---- other choices


def test_filterpy_believes_what_our_filter_believes(bandit, tmp_path):
    theirs = within(tmp_path / "filterpy", "backend=replay", f"backend.log={bandit.log}", "ekf=filterpy")
    assert theirs.code == 0 and theirs.summary["ekf"] == "filterpy"
    ours, others = list(read_beliefs(bandit.log)), list(read_beliefs(theirs.log))
    assert ours and [belief.t_ns for belief in ours] == [belief.t_ns for belief in others]
    for a, b in zip(ours, others, strict=True):
        spread = np.sqrt(np.diag(a.cov))
        np.testing.assert_allclose(b.mean, a.mean, rtol=1e-6, atol=1e-6 * spread.max())
        np.testing.assert_allclose(np.abs(b.mean - a.mean) / np.maximum(spread, 1e-12), 0, atol=1e-4)
        np.testing.assert_allclose(b.cov / np.outer(spread, spread), a.cov / np.outer(spread, spread), rtol=0, atol=1e-6)


def test_the_bandit_searches(bandit):
    assert bandit.code == 0 and bandit.json("status.json")["state"] == "done"
    assert "Bandit" in bandit.yaml("config.yaml")["search"]["_target_"]
    assert set(bandit.summary) == SUMMARY


def test_the_papers_filter_on_the_same_log(bandit, tmp_path):
    paper = within(tmp_path / "paper", "backend=replay", f"backend.log={bandit.log}", "ekf=paper")
    assert paper.code == 0 and paper.summary["ekf"] == "paper"
    assert paper.summary["calibration"] == bandit.summary["calibration"]
    assert paper.summary["calibrated"] != bandit.summary["calibrated"]


def test_the_papers_assembly_on_the_same_log(bandit, tmp_path):
    at_its_word = "belief_map.alternatives.worlds=[]"  # as it is for all but the filter that ran the search
    paper = within(tmp_path / "assembly", "backend=replay", f"backend.log={bandit.log}", "assembly=paper", at_its_word)
    assert paper.code == 0 and paper.summary["assembly"] == "paper"
    assert paper.yaml("calibration.yaml")["filter"]["assembly"] == "paper"
    assert paper.summary["calibrated"] == paper.summary["calibrated_paper_assembly"]
    assert paper.summary["calibration"] == bandit.summary["calibration"]


def test_one_degree_of_freedom_has_a_bearing_and_says_what_it_cannot_see(bearing):
    assert bearing.code == 0
    summary = bearing.summary
    for name in VARIANTS:
        assert set(summary[name]) == OUTCOME | {"bearing_error_deg"}
        assert summary[name]["source_error_m"] is None
        assert 0 <= summary[name]["bearing_error_deg"] <= 180
    assert summary["bound_m"] is None and summary["verdict"] in ("WARN", "FAIL")
    assert any("height and distance cannot be found with dof=1" in reason for reason in summary["reasons"])
    assert all(sample.q.shape == (1,) for sample in read_samples(bearing.log) if isinstance(sample, JointState))


def test_stages_left_out_give_null(tmp_path):
    short = within(tmp_path / "short", "sensor=ndir", "stage=[warm_up,baseline]")
    summary = short.summary
    assert short.code == 0 and set(summary) == SUMMARY
    assert [summary[key] for key in ("calibration", *VARIANTS, "bound_m", "simulated_s", "source_position_m", "scored")] == [None] * 9
    assert summary["dead_reckoning"] == {"nose_error_m": None}
    assert [c["name"] for c in summary["criteria"]] == ["warm_up", "baseline", "noise"] and set(summary["verdicts"]) == {"calibration"}
    assert short.yaml("calibration.yaml")["schema"] == "oio.results.baseline/1"


def test_the_order_that_ran_is_the_order_that_was_checked(made, built):
    stages = built("stage", *TINY)
    check_order(stages)
    assert list(stages) == STAGES == list(made.yaml("config.yaml")["stage"])
