"""A run in the Rerun viewer, without a window: what is written to the file, and what is refused."""

import importlib.util
import subprocess
import sys
from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pytest

from oio.cli.build import build
from oio.cli.compose import compose
from oio.cli.execute import execute
from oio.cli.replay_overrides import replayed
from oio.cli.sweep_check import refuse_bad_choices
from oio.core.errors import BadInput
from oio.core.records import SECOND_NS, Event, GasReading, Truth
from oio.log import ArmFrames, BeliefScene, BelievedNose, Progress, RunLog, Setup, StageMark, read_entries
from oio.view.__main__ import main
from oio.view.base import NoView, View
from oio.view.rerun_view import INSTALL, RerunView

pytestmark = pytest.mark.long

pytest.importorskip("rerun")

SHORT = (
    "sensor=ec", "dof=3", "stage.navigate.max_moves=20", "stage.map_beliefs.repeats=2", "stage.map_beliefs.budget_s=0",
    "stage.calibrate_bouts.moves_per_rung=2",
)  # fmt: skip
SHOWN = {
    "/base/arm", "/base/nose_path", "/base/nose_believed", "/base/box", "/base/beacon", "/base/belief/spheres", "/base/belief/hypotheses",
    "/base/truth/source", "/gas/element_0", "/gas/element_1", "/nis", "/joints", "/log", "/verdict",
}  # fmt: skip


def run(folder, *words):
    composed = compose((*SHORT, *words), ())
    return execute(build(composed.cfg, composed.choices, [*SHORT, *words]), folder, quiet=True)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A folder with `plain` and `viewed`, the same run without and with a view, the file of the view, and both summaries."""
    folder = tmp_path_factory.mktemp("view")
    plain = run(folder / "plain")
    return folder, plain, run(folder / "viewed", "view=rerun", f"view.file={folder}/viewed.rrd")


def printed(path, verbose="-v"):
    """What the viewer's own tool says of a file."""
    command = [sys.executable, "-m", "rerun", "rrd", "print", verbose, str(path)]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def entities(path):
    told = printed(path)
    return {name for name in SHOWN if f"{name}" in told}


def test_a_view_changes_no_result(made):
    folder, plain, viewed = made
    assert {**plain, "wall_s": 0} == {**viewed, "wall_s": 0}
    logs = [list(map(type, read_entries(folder / name / "run.mcap"))) for name in ("plain", "viewed")]
    assert logs[0] == logs[1]


def test_the_file_holds_all_that_is_to_be_seen_and_is_whole(made):
    folder, *_ = made
    assert entities(folder / "viewed.rrd") == SHOWN
    subprocess.run([sys.executable, "-m", "rerun", "rrd", "verify", str(folder / "viewed.rrd")], check=True, capture_output=True)


def test_a_log_shows_what_the_run_showed(made, capsys):
    folder, *_ = made
    assert main([str(folder / "plain"), "--save", str(folder / "log.rrd")]) == 0
    assert "entries" in capsys.readouterr().out
    assert entities(folder / "log.rrd") == SHOWN


def test_a_log_of_a_bench_has_the_time_of_day_too_and_the_name_of_its_folder(tmp_path):
    (tmp_path / "monday").mkdir()
    started = {"started": "2026-03-01T12:00:00+01:00"}
    with RunLog.create(tmp_path / "monday" / "run.mcap", sensor="ec", joints=("a",), metadata=started, attachments={}) as log:
        log.reading(GasReading(SECOND_NS, 0, 1.0, 0.1))
    assert main([str(tmp_path / "monday"), "--save", str(tmp_path / "monday.rrd")]) == 0
    told = printed(tmp_path / "monday.rrd", "-vvv")
    assert "time of day" in told and "2026-03-01T11:00:01" in told and "monday" in told
    assert "log_time" not in "".join(part for part in told.split("Chunk(") if "/gas/element_0" in part)  # when it was sent interests nobody


class Ear:
    """A view that remembers what it was told."""

    def __init__(self):
        self.heard = []

    def open(self):
        return nullcontext(self.heard.append)


def test_the_entries_of_a_log_are_those_that_watchers_heard(tmp_path):
    composed, ear = compose(SHORT, ()), Ear()
    execute(replace(build(composed.cfg, composed.choices, list(SHORT)), view=ear), tmp_path / "run", quiet=True)
    read = list(read_entries(tmp_path / "run" / "run.mcap"))
    told = [entry for entry in ear.heard if getattr(entry, "kind", "") != "progress"]  # which a file has once
    assert [type(entry) for entry in told] == [type(entry) for entry in read]
    for kind, same in (
        (StageMark, lambda a, b: a == b),
        (Progress, lambda a, b: a == b),
        (GasReading, lambda a, b: a.ppm == b.ppm and a.t_ns == b.t_ns),
        (BelievedNose, lambda a, b: np.array_equal(a.nose_m, b.nose_m)),
        (ArmFrames, lambda a, b: np.allclose(a.turns, b.turns, atol=2e-5) and np.array_equal(a.places_m, b.places_m)),
        (BeliefScene, lambda a, b: np.allclose(a.radii_m, b.radii_m) and a.text == b.text and len(a.hypotheses) == len(b.hypotheses)),
        (Setup, lambda a, b: np.array_equal(a.beacon_m, b.beacon_m)),
    ):
        pairs = [[entry for entry in side if isinstance(entry, kind)] for side in (told, read)]
        assert pairs[0] and all(same(a, b) for a, b in zip(*pairs, strict=True)), kind


def test_what_cannot_be_drawn_is_left_out_and_the_verdict_has_a_level(tmp_path):
    """Warnings are errors here: the SDK warns where it drops something."""
    nowhere, place = np.full(3, np.nan), np.array([0.3, 0.0, 0.1])
    view = RerunView(address=None, file=str(tmp_path / "odd.rrd"))
    with view.open() as watcher:
        for t, (mean, cov) in enumerate(
            [(nowhere, np.eye(3)), (place, np.zeros((3, 3))), (place, np.full((3, 3), np.inf)), (place, np.eye(3))]
        ):
            watcher(BeliefScene(t, np.array([place, nowhere]), np.array([0.1, 0.2]), [(mean, cov)], ""))
            watcher(Truth(t, np.zeros(1), place, mean, 0.0))
        watcher.flush()
        watcher(BeliefScene(5, np.zeros((0, 3)), np.zeros(0), [], ""))
        watcher(Truth(5, np.zeros(1), place, nowhere, 0.0))
        watcher(Event(6, "verdict", "FAIL. nothing was found."))
    told = printed(tmp_path / "odd.rrd", "-vvv")
    assert "FAIL. nothing was found." in told and "ERROR" in told and "/base/belief/hypotheses" in told


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"address": "127.0.0.1:9876", "file": None}, "rerun+http://127.0.0.1:9876/proxy"),
        ({"address": None, "file": "x.mcap"}, "ends in .rrd"),
        ({"address": "rerun://here/proxy", "file": "x.rrd"}, "Leave one out"),
    ],
)
def test_what_cannot_be_a_view_is_refused_before_anything_runs(given, words):
    with pytest.raises(BadInput, match=words.replace("+", r"\+")):
        RerunView(**given)


def test_no_display_no_folder_and_no_package_are_refused_with_what_to_type(tmp_path, monkeypatch):
    for variable in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(variable, raising=False)
    monkeypatch.setattr(sys, "platform", "linux")
    for view, words in (
        (RerunView(address=None, file=None), "no display"),
        (RerunView(address=None, file=str(tmp_path / "no" / "x.rrd")), "mkdir -p"),
        (RerunView(address=None, file=str(tmp_path / "x.rrd")), "never overwritten"),
    ):
        (tmp_path / "x.rrd").touch()
        with pytest.raises(BadInput, match=words), view.open():
            raise AssertionError
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(BadInput) as refused, RerunView(address=None, file=str(tmp_path / "y.rrd")).open():
        raise AssertionError
    assert str(refused.value) == INSTALL and "oio[view]" in INSTALL and refused.value.exit_code == 2


def test_an_address_where_no_viewer_answers_is_refused():
    with pytest.raises(BadInput, match="no Rerun viewer answers"), RerunView(address="rerun+http://127.0.0.1:9/proxy", file=None).open():
        raise AssertionError


def test_the_command_refuses_what_is_no_log(tmp_path, capsys):
    assert main([str(tmp_path / "none.mcap"), "--save", str(tmp_path / "x.rrd")]) == 2
    assert "no such file" in capsys.readouterr().err and not (tmp_path / "x.rrd").exists()


def test_a_sweep_has_no_view_and_a_replay_does_not_inherit_one(made):
    with pytest.raises(BadInput, match="Leave view= out"):
        refuse_bad_choices(["-m", "seed=0,1", "view=rerun"])
    folder, *_ = made
    words = ["backend=replay", f"backend.log={folder}/viewed/run.mcap"]
    assert "dof=3" in replayed(words) and not [word for word in replayed(words) if word.startswith("view")]


def test_choices_are_views(built):
    assert isinstance(built("view"), NoView) and isinstance(built("view", "view=rerun"), View)
