"""Runs that begin alike: the beginning is simulated once, and nothing that they leave is different."""

import json
from collections import Counter
from datetime import datetime

import pytest

from hardware.sensors.optical import Optical
from oio.cli.build import build
from oio.cli.compose import compose
from oio.cli.execute import execute
from oio.cli.shared_stages import SharedStages
from pipelines.baseline import Baseline
from pipelines.map_beliefs import MapBeliefs
from pipelines.warm_up import WarmUp

pytestmark = pytest.mark.long

QUICK = ("sensor=ndir", "dof=3", "seed=5", "stage.navigate.max_moves=7")


@pytest.fixture
def began(monkeypatch):
    """How often stages began."""
    count: Counter[str] = Counter()
    for kind in (WarmUp, Baseline, MapBeliefs):

        def run(self, context, kind=kind, plain=kind.run):
            count[kind.__name__] += 1
            return plain(self, context)

        run.__annotations__ = kind.run.__annotations__
        monkeypatch.setattr(kind, "run", run)
    return count


def run(folder, *words, shared=None):
    composed = compose(words, ())
    execute(build(composed.cfg, composed.choices, list(words)), folder, quiet=True, shared=shared)
    return folder


def left(folder):
    """All that a run left, but for what the clock decides."""
    files = {path.name: path.read_bytes() for path in folder.iterdir()}
    summary = json.loads(files.pop("summary.json"))
    del summary["wall_s"]
    status = json.loads(files.pop("status.json"))
    assert datetime.fromisoformat(status.pop("started")).tzinfo is not None
    return summary, status, files


@pytest.mark.parametrize("words", [("air=draft", "world=wall"), ("logging=summary", "backend.gas_delay_s=0.1")])
def test_filters_over_one_truth_are_calibrated_once_and_leave_what_they_leave_alone(tmp_path, began, words):
    shared = SharedStages()
    for ekf in ("ekf=ekf", "ekf=ukf"):
        together = run(tmp_path / f"together_{ekf}", *QUICK, *words, ekf, shared=shared)
        assert left(together) == left(run(tmp_path / f"alone_{ekf}", *QUICK, *words, ekf))
    assert began == {"WarmUp": 3, "Baseline": 3, "MapBeliefs": 3}  # 2 alone, 1 together


TINY = ("sensor=ndir", "stage=[warm_up,baseline]")


@pytest.mark.parametrize(
    "word", ["stage.warm_up.max_s=300", "seed=1", "air=draft", "backend.encoder_counts=2048", "sensor.spread.noise=4", "dof=3"]
)
def test_nothing_is_in_common_after_a_change_upstream(tmp_path, began, word):
    shared = SharedStages()
    run(tmp_path / "a", *TINY, shared=shared)
    run(tmp_path / "b", *TINY, word, shared=shared)
    assert began == {"WarmUp": 2, "Baseline": 2}


def test_only_what_comes_after_a_change_runs_again(tmp_path, began):
    shared = SharedStages()
    run(tmp_path / "a", *TINY, shared=shared)
    run(tmp_path / "b", *TINY, "stage.baseline.samples=60", shared=shared)
    assert began == {"WarmUp": 1, "Baseline": 2}


def test_a_run_that_failed_shares_what_it_had_done(tmp_path, began, monkeypatch):
    shared = SharedStages()
    with pytest.raises(Exception, match="the sensor is stuck"):
        run(tmp_path / "a", *TINY, "stage.baseline.samples=9000", "stage.baseline.max_s=1", shared=shared)
    run(tmp_path / "b", *TINY, shared=shared)
    assert began == {"WarmUp": 1, "Baseline": 2}


def test_a_world_with_a_part_of_a_plug_in_begins_anew(tmp_path, began, monkeypatch):
    """It may hold a function of itself, which a copy would share."""
    monkeypatch.setattr(Optical, "__module__", "my_sensors")
    shared = SharedStages()
    for name in "ab":
        run(tmp_path / name, *TINY, shared=shared)
    assert began == {"WarmUp": 2, "Baseline": 2}


def test_a_world_that_cannot_be_copied_begins_anew(tmp_path, began):
    """The same run as a replay of its log."""
    log = run(tmp_path / "a", *TINY) / "run.mcap"
    shared = SharedStages()
    for name in "bc":
        run(tmp_path / name, *TINY, "backend=replay", f"backend.log={log}", shared=shared)
    assert began == {"WarmUp": 3, "Baseline": 3}
