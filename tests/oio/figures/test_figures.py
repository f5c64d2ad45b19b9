"""The picture of a run, from small logs made here: its size, its words, what it refuses, and the numbers that are drawn."""

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.image import imread

from oio.core.records import SECOND_NS, Array, Belief, Event, GasReading, JointState, Truth
from oio.figures.__main__ import main
from oio.figures.geometry import ellipse, limits, radii_95, rows, source_errors
from oio.figures.run_history import RunHistory, read_run_history
from oio.figures.titles import ending, headline
from oio.figures.track import TrackOverTime
from oio.log import RunLog, read_hypotheses, read_odometry, read_readings, read_stages, read_states

ARM = b"""<mujoco><worldbody><body name="b"><body pos="0.1 0 0"><joint name="turn" axis="0 0 1"/>
<body pos="0.2 0 0"><joint name="lift" axis="0 1 0"/><body><joint name="roll" axis="1 0 0"/><site name="nose" pos="0.1 0 0"/></body></body>
</body></body></worldbody></mujoco>"""
BEACON, SOURCE = np.array([0.3, 0.1, 0.1]), np.array([0.2, -0.1, 0.15])
NAMES, UNITS = ("offset_turn", "source_x", "source_y", "source_z"), ("rad", "m", "m", "m")
OFF = np.array([0.03, 0.0, 0.0])
COV = np.diag([1e-6, 4e-4, 1e-4, 1e-4])


def write(folder: Path, *, truth: bool = True, arm: bool = True, dof: int = 3, believe: bool = True) -> Path:
    """Ten seconds: five with the beacon in stage `map_beliefs`, five with the source in `navigate`, belief 30 mm off in x."""
    folder.mkdir(exist_ok=True)
    attachments = {"arm.mjcf": ARM, "config.yaml": b"arm: {home_rad: [0.0, 0.5, 0.0]}"} if arm else {}
    joints, now = ("turn", "lift", "roll")[:dof], [0]
    made = RunLog.create(folder / "run.mcap", sensor="ec", joints=joints, metadata={"seed": "7"}, attachments=attachments)
    with made as log:
        log.write(Event(0, "present", "beacon"))
        with log.stage("map_beliefs", lambda: now[0]):
            now[0] = tell(log, range(51), BEACON if truth else None, dof, False)
        log.write(Event(now[0], "present", "source"))
        with log.stage("navigate", lambda: now[0]):
            now[0] = tell(log, range(51, 101), SOURCE if truth else None, dof, believe)
    return folder


def tell(log: Any, ticks: range, source_m: Array | None, dof: int, believe: bool) -> int:
    for i in ticks:
        t_ns = i * SECOND_NS // 10
        q = np.array([np.sin(i / 10), 0.2, 0.1])[:dof]
        log.write(JointState(t_ns, q, 0 * q, 0 * q))
        if source_m is not None:
            log.write(Truth(t_ns, q, [0.3, 0.01 * i, 0.1], source_m, 5.0))
        log.reading(GasReading(t_ns, i % 2, 10.0 + 5 * np.sin(i), 0.5))
        if believe:
            log.estimate(Belief(t_ns, [0.0, *(SOURCE + OFF)], COV), NAMES, UNITS)
            log.odometry(t_ns, np.array([0.3, 0.01 * i, 0.104]), 1e-6 * np.eye(3))
    return ticks[-1] * SECOND_NS // 10


def summary(folder: Path, **values: Any) -> None:
    document = {"schema": "oio.results.summary/1", "sensor": "ec", "dof": 5, "air": "still", "seed": 3, **values}
    (folder / "summary.json").write_text(json.dumps(document))


def png_size(path: Path) -> tuple[int, int]:
    data = path.read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    width, height = struct.unpack(">II", data[16:24])
    return width, height


@pytest.mark.parametrize(
    "case", [{}, {"truth": False}, {"arm": False}, {"dof": 2}, {"dof": 1}, {"believe": False}, {"truth": False, "believe": False}]
)
def test_a_picture_of_any_run(tmp_path: Path, case: dict[str, Any], capsys: pytest.CaptureFixture[str]) -> None:
    run = write(tmp_path / "run", **case)
    assert main([str(run)]) == 0
    assert capsys.readouterr().out == f"{run / 'search.png'}\n"
    assert png_size(run / "search.png") == (1600, 900)
    assert (run / "search.png").stat().st_size < 300_000
    ink = np.mean(imread(run / "search.png")[..., :3] < 0.99)
    assert 0.005 < ink < 0.5


def test_the_same_run_gives_the_same_bytes(tmp_path: Path) -> None:
    run = write(tmp_path / "run")
    summary(run, cold={"source_error_m": 0.1}, calibrated={"source_error_m": 0.01, "nose_error_m": 0.004})
    pictures = [tmp_path / "a.png", tmp_path / "b.png"]
    assert [main([str(run), "--out", str(out)]) for out in pictures] == [0, 0]
    assert pictures[0].read_bytes() == pictures[1].read_bytes()
    assert not (run / "search.png").exists()


def test_an_empty_log_gives_a_picture(tmp_path: Path) -> None:
    with RunLog.create(tmp_path / "run.mcap", sensor="ec", joints=("a",), metadata={}, attachments={}):
        pass
    assert main([str(tmp_path)]) == 0


def test_the_story_is_what_was_logged(tmp_path: Path) -> None:
    story = read_run_history(write(tmp_path / "run") / "run.mcap")
    assert [(s.stage, s.begin_s, s.end_s) for s in story.spans] == [("map_beliefs", 0.0, 5.0), ("navigate", 5.0, 10.0)]
    assert story.search == story.spans[1]
    assert {name: place.tolist() for name, place in story.places.items()} == {"beacon": BEACON.tolist(), "source": SOURCE.tolist()}
    assert [len(c) for c in (story.truth, story.odometry, story.dead, story.source)] == [51, 50, 51, 50]
    t_s, off_m = story.odometry.distances(story.truth)
    np.testing.assert_allclose((t_s[0], t_s[-1]), (5.1, 10.0))
    np.testing.assert_allclose(off_m, 0.004)
    q = np.sin(10.0)  # the arm: 0.1 m to the first joint, 0.2 m on to the second, 0.1 m on to the nose
    reach = 0.2 + 0.1 * np.cos(0.2)
    np.testing.assert_allclose(story.dead.p_m[-1], [0.1 + reach * np.cos(q), reach * np.sin(q), -0.1 * np.sin(0.2)])
    np.testing.assert_allclose(story.shoulder_m, [0.1, 0, 0])


def test_locked_joints_rest_at_home(tmp_path: Path) -> None:
    story = read_run_history(write(tmp_path / "run", dof=1) / "run.mcap")
    np.testing.assert_allclose(story.dead.p_m[-1, 2], -0.1 * np.sin(0.5))


def test_the_source_is_also_believed_at_the_end_of_a_move(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    turned = np.array([[3.0, 1, 0], [1, 2, 0.5], [0, 0.5, 1]]) * 1e-4
    with RunLog.create(path, sensor="ec", joints=("a",), metadata={}, attachments={}) as log:
        log.estimate(Belief(1, np.append(0.0, SOURCE), COV), NAMES, UNITS)
        log.spheres(2, np.zeros((0, 3)), np.zeros(0), [(BEACON, turned), (SOURCE, COV[1:, 1:])], "two")
        log.spheres(3, np.zeros((0, 3)), np.zeros(0), [], "none")
    (_, first), (t_ns, nothing) = read_hypotheses(path)
    assert (len(first), t_ns, nothing) == (2, 3, [])
    story = read_run_history(path)
    np.testing.assert_allclose(story.source.p_m, [SOURCE, BEACON])
    np.testing.assert_allclose(story.source.cov_m2[-1], turned, atol=1e-15)


def test_what_is_not_finite_is_left_out(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    with RunLog.create(path, sensor="ec", joints=("a",), metadata={}, attachments={}) as log:
        log.estimate(Belief(1, np.full(4, np.nan), COV), NAMES, UNITS)
        log.estimate(Belief(2, np.zeros(4), COV), ("a", "b", "c", "d"), UNITS)
        log.odometry(3, np.zeros(3), np.full((3, 3), np.inf))
        log.write(Truth(4, [0.0], [0.0, 0.0, np.nan], np.full(3, np.nan), 1.0))
    story = read_run_history(path)
    assert [len(c) for c in (story.truth, story.odometry, story.source)] == [0, 0, 0]
    assert story.places == {}


def test_a_stage_without_its_end_lasts_until_the_log_ends(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    with RunLog.create(path, sensor="ec", joints=("a",), metadata={}, attachments={}) as log:
        log._mark("navigate", "begin", SECOND_NS, None)
        log.reading(GasReading(3 * SECOND_NS, 0, 1.0, 0.1))
    assert read_run_history(path).search.end_s == 3.0


def test_readers_give_what_was_written(tmp_path: Path) -> None:
    path = write(tmp_path / "run") / "run.mcap"
    assert [row[1:] for row in read_stages(path)] == [(s, e) for s in ("map_beliefs", "navigate") for e in ("begin", "end")]
    reading = next(read_readings(path))
    assert (reading.t_ns, reading.element, reading.ppm, reading.sigma_ppm) == (0, 0, 10.0, 0.5)
    names, belief = next(read_states(path))
    assert names == NAMES
    assert belief.cov.tolist() == COV.tolist()
    t_ns, nose_m, cov = next(read_odometry(path))
    assert (t_ns, nose_m.tolist(), cov.tolist()) == (51 * SECOND_NS // 10, [0.3, 0.51, 0.104], (1e-6 * np.eye(3)).tolist())


def test_a_failed_stage_is_read(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    made = RunLog.create(path, sensor="ec", joints=("a",), metadata={}, attachments={})
    with made as log, pytest.raises(RuntimeError), log.stage("navigate", lambda: 7):
        raise RuntimeError("no")
    assert list(read_stages(path)) == [(7, "navigate", "begin"), (7, "navigate", "failed")]


def story_of(source_m: Array, believed_m: Array, cov: Array, dof: int) -> RunHistory:
    nothing = TrackOverTime(np.zeros(0), np.zeros((0, 3)), np.zeros((0, 3, 3)))
    believed = TrackOverTime(np.zeros(1), believed_m[None, :], cov[None, :, :])
    return RunHistory(
        {"dof": str(dof)}, (), None, (), nothing, nothing, nothing, believed, np.zeros(3), np.zeros((0, 3)), {"source": source_m}
    )  # type: ignore[arg-type]


def test_errors_of_the_source() -> None:
    source, cov = np.array([1.0, 0.0, 0.0]), np.diag([0.01, 0.04, 0.04])
    story = story_of(source, source + np.array([0, 0.003, 0.004]), cov, 5)
    error, bound, unit = source_errors(story, story.source)
    np.testing.assert_allclose((error[0], bound[0]), (5.0, 1e3 * radii_95(cov[None])[0]))
    assert unit == "mm"
    far = 7 * np.array([np.cos(0.2), np.sin(0.2), 0.0])  # how far it is believed to be does not count with one joint
    story = story_of(source, far, 0.04 * np.eye(3), 1)
    error, bound, unit = source_errors(story, story.source)
    np.testing.assert_allclose((error[0], bound[0]), (np.degrees(0.2), np.degrees(1.96 * 0.2 / 7)), rtol=0.015)
    assert unit == "deg"


@pytest.mark.parametrize("sds", [(1.0, 1.0, 1.0), (1.0, 0.5, 0.1), (1.0, 0.01, 0.01), (2.0, 1.0), (3.0,)])
def test_95_percent_of_errors_are_shorter_than_the_radius(sds: tuple[float, ...]) -> None:
    errors = np.random.default_rng(1).standard_normal((200_000, len(sds))) * sds
    assert np.mean(np.linalg.norm(errors, axis=1) < radii_95(np.diag(np.square(sds))[None])[0]) == pytest.approx(0.95, abs=0.004)


def test_the_ellipse_holds_95_percent() -> None:
    cov = np.array([[4.0, 1.5, 0.3], [1.5, 1.0, 0.2], [0.3, 0.2, 9.0]])
    off = ellipse(np.array([1.0, 2.0, 3.0]), cov) - [1.0, 2.0]
    np.testing.assert_allclose(np.einsum("ki,ij,kj->k", off, np.linalg.inv(cov[:2, :2]), off), 5.9915, rtol=1e-4)


def test_limits_keep_scales_equal_and_far_things_out() -> None:
    core, far = np.array([[0.0, 0.0], [400.0, 200.0]]), np.array([[100.0, 90_000.0]])
    for shape in (0.5, 1.0, 2.0):
        low, high = limits(core, far, shape)
        width, height = high - low
        assert width == pytest.approx(shape * height)
        assert np.all(low < 0)
        assert np.all(high > 200)
        assert max(width, height) < 1500


def test_labels_that_would_overlap_go_to_another_row() -> None:
    assert rows([5, 8, 20, 26, 27], [10, 10, 10, 10, 10]) == [0, 1, 0, 1, 2]
    assert rows([], []) == []


def test_words() -> None:
    assert headline({"sensor": "ec", "dof": "5", "seed": "7"}, {}) == "sensor ec, 5 DoF, seed 7"
    assert headline({"sensor": "ec", "air": "still", "backend": "recording"}, {"seed": 0}) == "sensor ec, backend recording"
    assert headline({"sensor": "ec"}, {"dof": 3, "air": "draft", "seed": None}) == "sensor ec, 3 DoF, air draft"
    found = {"cold": {"source_error_m": 0.0853}, "calibrated": {"source_error_m": 0.0121}}
    assert ending(found) == "source error: cold start 85.3 mm → calibrated 12.1 mm"
    found = {"cold": {"bearing_error_deg": 9.0}, "calibrated": {"bearing_error_deg": 1.25}}
    assert ending(found) == "bearing error: cold start 9.0 deg → calibrated 1.2 deg"
    assert ending({"cold": None, "calibrated": None}) == ""


def refusal(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    assert main(arguments) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    return said.err.strip()


def test_no_whole_log(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "run.mcap"
    give = "Give the log of an OIO run, e.g. outputs/2026-01-31/12-00-00/run.mcap."
    assert refusal([str(tmp_path)], capsys) == f"{path} was given as a log, but there is no such file. {give}"
    path.write_bytes(b"t_s,ppm\n0,5\n")
    assert refusal([str(tmp_path)], capsys) == f"{path} was given as a log, but it is not an MCAP file. {give}"
    whole = (write(tmp_path / "whole") / "run.mcap").read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    assert f"Type `python -m oio.recover {path}` to make one of it." in refusal([str(tmp_path)], capsys)
    part = path.rename(tmp_path / "run.mcap.part")
    assert f"{part} has no end: the run was killed" in refusal([str(tmp_path)], capsys)
    assert not list(tmp_path.glob("*.png"))


def test_no_summary(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = write(tmp_path / "run")
    path = run / "summary.json"
    path.write_text("{")
    assert refusal([str(run)], capsys).startswith(f"{path} was given as a summary, but it cannot be read (Expecting property name")
    path.write_text("[]")
    assert refusal([str(run)], capsys) == (
        f"{path} was given as a summary, but it is not of schema oio.results.summary/2. "
        "Remove it to draw the run from its log alone, or run the experiment again."
    )


def test_no_place_for_the_picture(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = write(tmp_path / "run")
    out = tmp_path / "none" / "a.png"
    assert refusal([str(run), "--out", str(out)], capsys) == (
        f"--out is {out}, but that cannot be written (No such file or directory). Give a file in a folder that exists."
    )
    assert refusal([str(run), "--out", "a.pdf"], capsys) == "--out is a.pdf, but a picture is a PNG. Type e.g. --out a.png"


def test_help(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["--help"])
    assert ended.value.code == 0
    assert "RUN_DIR" in capsys.readouterr().out
