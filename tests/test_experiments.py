"""What conf/experiment says it does: the paper's table and its figure."""

import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from oio.bench.trial import experiment, run_trial
from oio.core.folders import CONF
from oio.figures.ekf import draw
from oio.log import MemoryLog
from oio.results.tracks import Tracks
from oio.runtime.runner import run_stages
from oio.sweep.table_1 import Published, show_table_1, table_1

SHORT = (
    "+experiment=figure_ekf", "sensor=ndir", "air=steady", "dof=3", "stage.navigate.max_moves=7", "stage.map_beliefs.repeats=2",
    "stage.map_beliefs.budget_s=0", "stage.calibrate_bouts.moves_per_rung=2",
)  # fmt: skip


@pytest.mark.parametrize("path", sorted((CONF / "experiment").glob("*.yaml")), ids=lambda path: path.stem)
def test_every_experiment_names_its_command_first(path: Path):
    first, second = path.read_text(encoding="utf-8").splitlines()[:2]
    assert first == "# @package _global_"
    assert second.startswith("# ") and ("`python -m oio.run" in second or "`python -m oio.bench" in second)


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    """The stages of the figure, in memory; a benchmark's cold start would make its last map alone."""
    out, built = tmp_path_factory.mktemp("figure"), experiment(SHORT, 0)
    stages = {**built.stages, "evaluate": replace(built.stages["evaluate"], cold_maps="all")}
    with built.backend.open() as world:
        return run_stages(stages, world, built.arm, MemoryLog(), out, 0), out


def test_the_figure_is_drawn_from_the_filters_that_are_scored(drawn):
    results, out = drawn
    found, scored = results[Tracks], next(r for kind, r in results.items() if kind.__name__ == "Evaluation")
    assert (out / "figure_ekf.png").read_bytes().startswith(b"\x89PNG")
    for name in ("cold", "calibrated"):
        assert tuple(found.sources[name][0]) == getattr(scored, name).believed_m
        believed, true = found.believed_m[name], found.true_m
        off = np.linalg.norm(believed - true[len(true) - len(believed) :], axis=1)
        assert np.sqrt(np.mean(off**2)) == pytest.approx(getattr(scored, name).nose_error_m)


def test_a_search_without_a_map_or_a_truth_is_drawn_as_well(tmp_path):
    nothing = np.zeros((0, 3))
    draw(Tracks(nothing, nothing, {"cold": nothing, "calibrated": nothing}, {}, None), tmp_path / "empty.png")
    assert (tmp_path / "empty.png").is_file()


def test_table_1_stands_beside_the_papers(composed):
    told = io.StringIO()
    runs = [{"sensor": "ec", "calibration": {"time_s": t, "error_ppm": e}} for t, e in ((80.0, 1.0), (90.0, 2.0), (91.0, 9.0))]
    show_table_1([*runs, {"sensor": "ndir", "calibration": None}], table_1(CONF), Console(file=told, width=120))
    (line,) = [line for line in told.getvalue().splitlines() if "ec " in line]
    assert line.replace("│", "").split() == ["ec", "3", "90", "87", "2.0", "20"]
    assert table_1(CONF)["ndir"] == Published(51, 30)
    cfg = composed("+experiment=table_1")
    assert list(cfg.stage) == ["warm_up", "baseline", "calibrate_bouts", "map_beliefs", "assemble_qr"]


def test_the_paper_to_the_letter_runs_end_to_end(composed):
    """Its spheres, its Q and R, its filter and its bandit, none of ours; and whatever they believe is scored as every other."""
    words = ("+experiment=paper_literal", "sensor=ndir", "air=steady", *SHORT[3:])
    cfg = composed(*words)
    kinds = [cfg[key]["_target_"].rsplit(".", 1)[1] for key in ("belief_map", "ekf", "search")]
    assert kinds == ["SphereMap", "PaperEkf", "Bandit"] and cfg.assembly == "paper"
    told = run_trial(words, 0)
    assert told["calibrated"]["source_error_m"] is not None and told["calibrated"]["nees_source"] is not None
    assert told["calibration"]["u_b_m"] > 0.0 and told["calibrated"]["world"] == "as calibrated"
