"""Mistakes on the command line: exit code 2, one paragraph that says what was given and what is allowed, and nothing left behind."""

import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from hydra.core.global_hydra import GlobalHydra
from mcap.writer import Writer

from oio.cli import run

ROOT = Path(__file__).resolve().parents[1]
RECORDINGS = "airscout32, co2_scd30x4, csv, orebro3dsen, scd30_windows, sgp30_64h, smellnet, waag_ec"
STAGES = ("assemble_qr", "baseline", "calibrate_bouts", "evaluate", "map_beliefs", "navigate", "warm_up")


@pytest.fixture
def typed(tmp_path, monkeypatch, capfd):
    """typed("dof=4") is the exit code and what stderr says, in this process; whatever was left lies in `tmp_path / "run"`."""

    def type_(*words):
        GlobalHydra.instance().clear()
        monkeypatch.chdir(tmp_path)
        monkeypatch.setenv("HYDRA_FULL_ERROR", "1")
        monkeypatch.delenv("OIO_FULL_ERROR", raising=False)
        monkeypatch.setattr(sys, "argv", ["oio.run", *words, f"hydra.run.dir={tmp_path / 'run'}"])
        monkeypatch.setattr(sys, "path", list(sys.path))
        code = run.main()
        said = capfd.readouterr()
        assert said.out == ""
        return code, said.err

    handler = signal.getsignal(signal.SIGTERM)
    yield type_
    signal.signal(signal.SIGTERM, handler)
    GlobalHydra.instance().clear()


def assert_one_paragraph(said):
    assert said.startswith("oio: ") and said.endswith("\n")
    assert said.count("\n") == 1
    for word in ("Traceback", "Error executing job", "full_key", "HYDRA_FULL_ERROR", "instantiat"):
        assert word not in said


def assert_nothing_left(tmp_path):
    assert list(tmp_path.iterdir()) == []


# ---- refused before anything is made: a list of what must be said, or the text word for word

REFUSED = [
    (["dof=4"], "dof=4 is not on the ladder of arm 'so101'. It can be 1, 2, 3, 5. Type e.g. dof=5."),
    (["dof=five"], ["dof=five", "Type e.g. dof=5"]),
    (["dof=-3"], ["dof=-3", "Type e.g. dof=5"]),
    (["arm=ur5"], ["Type e.g. arm=ur5e."]),
    (["arm.box_low_m=[0.7,-0.45,0.01]"], ["arm.box_low_m is [0.7, -0.45, 0.01] and arm.box_high_m [0.58, 0.45, 0.5]", "lower corner"]),
    (["stage=[warm_up]", "nominal.rise_s=nan"], ["nominal.rise_s is nan, but a finite number is needed."]),
    (["stage=[warm_up]", "profile.pa.tau_rise_s=-1"], ["profile.pa.tau_rise_s is -1, but"]),
    (["stage=[warm_up]", "stop.sd_m=10"], ["stop.sd_m is 10, but 1e-05 to 1 is allowed."]),
    (["--verson"], ["--verson was given, but oio.run has no such option. Type --version, or KEY=VALUE words"]),
    (["--cfg=jop"], ["--cfg/-c: invalid choice: 'jop'", "Type KEY=VALUE words, e.g. sensor=ec dof=5"]),
    (["--config-name=mine"], ["--config-name mine was given, but OIO has one configuration."]),
    (["sensor=xx"], "sensor=xx was given, but sensor can be ec, mox_mics, mox_mq, ndir, pa. Type e.g. sensor=ec."),
    (["sensor=[ec,ndir]"], ["is not a key of its YAML", "choose one, sensor=NAME. Several are a sweep: -m sensor=NAME,NAME"]),
    (["+bout.window_by_dof={a:3}"], ["bout.window_by_dof"]),
    (["arm=so101_stereo", "sensor=ndir", "backend.sampling=together"], ["sensor 'ndir' has one element: there is no pair to sample"]),
    (["profile=p"], ["profile=p", "datasheet", "paper"]),
    (["air=x"], ["air=x", "draft", "steady", "still", "ventilated"]),
    (["ekf=x"], ["ekf=x", "ckf, ekf, filterpy"]),
    (["search=x"], ["search=x", "bandit", "d_optimal"]),
    (["sensor=null"], ["null was given where a choice is a word", "--help"]),
    (["protocol=x"], ["protocol=x", "bench, emulated"]),
    (["protocol=bench"], ["protocol=bench asks for operator", "there is no terminal", "protocol.answers=FILE"]),
    (["protocol=bench", "stage=[warm_up]"], ["the step room_degc after the stage baseline", "stage=[warm_up]"]),
    (["backend=x"], ["backend=x", "mujoco", "recording", "replay"]),
    (["stage=[warm,baseline]"], ["stage=warm", *STAGES]),
    (["stage=[navigate]"], ["'navigate' needs Calibration", "['navigate']"]),
    (
        ["stage=[baseline,warm_up]"],
        "stage 'baseline' needs WarmUpResult, but no stage before it gives one: the order is ['baseline', 'warm_up']. "
        "Put 'warm_up' earlier.",
    ),
    (["foo=1"], ["'foo'", "--cfg job"]),
    (["+foo.bar=3"], "'foo.bar' was given, but nothing reads it. `python -m oio.run --cfg job` prints every key."),
    (["++foo=1"], ["'foo' was given, but nothing reads it"]),
    (["+stpo={sd_m: 0.1}"], ["'stpo.sd_m' was given, but nothing reads it", "type stop.sd_m=VALUE"]),
    (["+seedd=3"], ["'seedd' was given, but nothing reads it", "type seed=VALUE"]),
    (["+profile.max_d=3"], ["'profile.max_d' was given, but nothing reads it", "type profile.max_s=VALUE"]),
    (["-m", "+stpo.sd_m=1", "seed=0,1"], ["'stpo.sd_m' was given", "type stop.sd_m=VALUE"]),
    (["stage.navigate.max_mvoes=3"], ["'stage.navigate.max_mvoes' is not a key", "type stage.navigate.max_moves=VALUE"]),
    (["stage.navgate.max_moves=3"], ["type stage.navigate.max_moves=VALUE"]),
    (["max_moves=3"], ["type stage.navigate.max_moves=VALUE"]),
    (["stop.sd_mm=3"], ["type stop.sd_m=VALUE"]),
    (["+stop.sdm=3"], ["'stop.sdm' is not a key of its YAML", "type stop.sd_m=VALUE"]),
    (["sensors=ec"], ["type sensor=VALUE"]),
    (["stage=[warm_up]", "stage.navigate.max_moves=9"], ["is a key of stage=[...,navigate] only"]),
    (["sensor.foo=1"], ["'sensor.foo'", "--cfg job"]),
    (["+sensor.foo=1"], ["foo", "--cfg job"]),
    (["~sensor.gas"], ["sensor", "gas"]),
    (["sensor.spread.noise=a"], ["sensor.spread.noise is 'a'", "it must be a number. Type e.g. sensor.spread.noise="]),
    (["air.wind_m_s=nan"], "air.wind_m_s is nan, but a finite number is needed. Type e.g. air.wind_m_s=0.05."),
    (["air.wind_m_s=99"], ["air.wind_m_s is 99", "0 to 10"]),
    (["stage.evaluate.cold_maps=first"], ["cold_maps is 'first'", "all or last"]),
    (["stage.navigate.max_moves=2"], ["stage.navigate.max_moves is 2", "4 to 10000"]),
    (["stage.navigate.max_moves=5"], ["stage.navigate.max_moves is 5", "at least mapping.explore_moves, which is 6"]),
    (["source.position=[nan,0,0.1]"], ["source.position[0] is nan", "finite"]),
    (["source.position=[1,2]"], ["source.position is [1.0, 2.0], but it must be three numbers or null."]),
    (
        ["beacon.position=null"],
        "beacon.position is null, but calibration needs a source whose place is known. Type beacon.position=[0.33,0.10,0.16].",
    ),
    (
        ["beacon.position=[1,2]"],
        "beacon.position is [1.0, 2.0], but it must be three numbers or null. Type e.g. beacon.position=[0.33,0.1,0.16].",
    ),
    (["stop.sd_m=10"], "stop.sd_m is 10, but 1e-05 to 1 is allowed. Type e.g. stop.sd_m=0.01."),
    (["climate.period_s=0"], "climate.period_s is 0, but 1 to 1e+07 is allowed. Type e.g. climate.period_s=900."),
    (["process_noise.offset_deg_sqrt_s=-1"], ["process_noise.offset_deg_sqrt_s is -1, but 0 to 10 is allowed."]),
    (["profile.max_s=-1"], "profile.max_s is -1, but 1 to 1e+06 is allowed. Type e.g. profile.max_s=600."),
    (["stop=5"], "stop is 5, but it must be a StopRule, with keys of its own. Type e.g. stop.sd_m=0.01."),
    (
        ["stage=[warm_up,warm_up]"],
        "stage=[warm_up,warm_up] was given, but warm_up can run once in a run. Type stage=[warm_up], and repeat the run for another one.",
    ),
    (["seed=-1"], "seed=-1 was given, but seed is a whole number, 0 or more. Type e.g. seed=0."),
    (["seed=null"], ["seed=", "0 or more"]),
    (["seed=1.5"], ["seed=1.5", "whole number"]),
    (["assembly=x"], "assembly=x was given, but assembly can be gum or paper. Type e.g. assembly=gum."),
    (["sensor=["], ["could not be read", "'['", "KEY=VALUE"]),
    (["sensor"], ["could not be read", "KEY=VALUE"]),
    (["backend=replay"], "backend.log has no value. Type backend.log=VALUE."),
    (["backend=replay", "backend.log=/nope"], ["/nope", "no such file", "run.mcap"]),
    (["backend.log=/nope"], ["backend.log"]),
    (["backend=recording"], ["recording", RECORDINGS]),
    (["backend=recording", "recording=x"], ["recording=x", RECORDINGS]),
]


@pytest.mark.parametrize(("words", "expected"), REFUSED, ids=[" ".join(words) for words, _ in REFUSED])
def test_a_mistake_is_refused_in_one_paragraph(typed, tmp_path, words, expected):
    code, said = typed(*words)
    assert code == 2
    assert_one_paragraph(said)
    if isinstance(expected, str):
        assert said == f"oio: {expected}\n"
    for text in expected:
        assert text in said
    assert_nothing_left(tmp_path)


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["stage=[]"], ["stage=", "warm_up"]),
        (["dof=-3"], ["1, 2, 3, 5"]),
        (["dof=five"], ["1, 2, 3, 5"]),
        (["seed=null"], ["seed=null"]),
        (["sensor.spread.noise=a"], ["sensor.spread.noise"]),
        (["backend.log=/nope"], ["backend=replay"]),
    ],
    ids=lambda value: " ".join(value),
)
def test_the_paragraph_says_what_to_type(typed, words, expected):
    _, said = typed(*words)
    for text in expected:
        assert text in said


# ---- refused by the world as it opens

OPENING = [
    (["source.position=[2,0,0]"], ["source.position is [2.0, 0.0, 0.0]", "cannot come within 0.06 m", "(0.1, -0.45, 0.01)"]),
    (["beacon.position=[2,0,0]"], ["beacon.position is [2.0, 0.0, 0.0]", "beacon.position=["]),
    (["backend=recording", "recording=airscout32", "stage=[warm_up,baseline]"], ["session_A", "OIO_DATA", "airscout32", "github.com"]),
]
OPENING_IDS = [" ".join(words) for words, _ in OPENING]


@pytest.mark.parametrize(("words", "expected"), OPENING, ids=OPENING_IDS)
def test_what_the_world_refuses_is_said_in_one_paragraph(typed, tmp_path, monkeypatch, words, expected):
    monkeypatch.setenv("OIO_DATA", str(tmp_path / "data"))
    code, said = typed(*words)
    assert code == 2
    assert_one_paragraph(said)
    for text in expected:
        assert text in said
    assert not (tmp_path / "run" / "run.mcap.part").exists()


@pytest.mark.parametrize("words", [OPENING[0][0], OPENING[-1][0]], ids=[OPENING_IDS[0], OPENING_IDS[-1]])
def test_what_the_world_refuses_leaves_nothing(typed, tmp_path, monkeypatch, words):
    monkeypatch.setenv("OIO_DATA", str(tmp_path / "data"))
    assert typed(*words)[0] == 2
    assert_nothing_left(tmp_path)


# ---- files


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    """A short finished log."""
    out = tmp_path_factory.mktemp("logged") / "run"
    line = [sys.executable, "-m", "oio.run", "sensor=ndir", "stage=[warm_up,baseline]", f"hydra.run.dir={out}"]
    subprocess.run(line, cwd=ROOT, capture_output=True, check=True, timeout=120)
    return out / "run.mcap"


def truncated(log, path):
    path.write_bytes(log.read_bytes()[:-100])


def flipped(log, path):
    data = bytearray(log.read_bytes())
    data[-60] ^= 0xFF
    path.write_bytes(data)


def foreign_mcap(log, path):
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        writer.finish()


FILES = [
    (truncated, ["has no end", "readable until", "python -m oio.recover"]),
    (flipped, ["damaged", "python -m oio.recover"]),
    (lambda log, path: path.write_text("hello\n"), ["not an MCAP file"]),
    (lambda log, path: path.write_bytes(b""), ["not an MCAP file"]),
    (lambda log, path: path.mkdir(), ["it is a folder"]),
    (foreign_mcap, ["not written by OIO"]),
]


@pytest.mark.parametrize(("spoil", "expected"), FILES, ids=["truncated", "flipped", "text", "empty", "folder", "foreign"])
def test_a_file_that_is_no_log_is_refused(typed, tmp_path, tmp_path_factory, log, spoil, expected):
    path = tmp_path_factory.mktemp("given") / "given.mcap"
    spoil(log, path)
    code, said = typed("backend=replay", f"backend.log={path}")
    assert code == 2
    assert_one_paragraph(said)
    for text in [str(path), *expected]:
        assert text in said
    assert_nothing_left(tmp_path)


def test_a_log_of_another_sensor_is_refused(typed, log):
    code, said = typed("backend=replay", f"backend.log={log}", "sensor=pa")
    assert code == 2
    assert_one_paragraph(said)
    assert "was made with sensor=ndir dof=5, but sensor=pa dof=5 is set. Type sensor=ndir dof=5." in said


def test_a_directory_that_holds_a_run_is_never_written_to(typed, tmp_path, log):
    shutil.copytree(log.parent, tmp_path / "run")
    before = {path.name: path.read_bytes() for path in (tmp_path / "run").iterdir()}
    code, said = typed("sensor=ndir", "stage=[warm_up,baseline]")
    assert code == 2
    text = f"{tmp_path / 'run'} already holds a run (status.json). Give another directory, e.g. hydra.run.dir={tmp_path / 'run'}_2."
    assert said == f"oio: {text}\n"
    assert {path.name: path.read_bytes() for path in (tmp_path / "run").iterdir()} == before


def test_files_of_somebody_else_are_never_written_over(typed, tmp_path):
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "config.yaml").write_text("mine: 1\n", encoding="utf-8")
    code, said = typed("sensor=ndir", "stage=[warm_up,baseline]")
    assert code == 2
    assert_one_paragraph(said)
    assert "holds config.yaml, which a run would overwrite. Give another directory" in said
    assert (tmp_path / "run" / "config.yaml").read_text(encoding="utf-8") == "mine: 1\n"


# ---- as a person types it


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["dof=4"], "oio: dof=4 is not on the ladder of arm 'so101'. It can be 1, 2, 3, 5. Type e.g. dof=5.\n"),
        (["sensor=xx"], "oio: sensor=xx was given, but sensor can be ec, mox_mics, mox_mq, ndir, pa. Type e.g. sensor=ec.\n"),
        (
            ["backend=replay", "backend.log=/nope"],
            "oio: /nope was given as a log, but there is no such file. "
            "Give the log of an OIO run, e.g. outputs/2026-01-31/12-00-00/run.mcap.\n",
        ),
    ],
    ids=["dof", "sensor", "log"],
)
def test_the_command_itself(tmp_path, words, expected):
    line = [sys.executable, "-m", "oio.run", *words, f"hydra.run.dir={tmp_path / 'run'}"]
    done = subprocess.run(line, cwd=ROOT, capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (2, "", expected)
    assert_nothing_left(tmp_path)
