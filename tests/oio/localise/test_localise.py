"""`python -m oio.localise`: the source of a log whose nose was moved, with and without a calibration; and what is refused."""

import json
import re
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import oio
from oio.localise.command import HELP, main

BEACON_M, SOURCE_M = np.array([0.10, 0.05, 0.0]), np.array([-0.05, 0.08, 0.10])
NOSE = "nose_columns=[x [mm],y [mm],z [mm]]"
BY_ITSELF = ("sensor=ndir", NOSE, "clean_air_s=[0,19.9]", "beacon_m=[0.10,0.05,0]", "beacon_s=[19.9,139.9]")


def nose_m(t_s):
    return 0.25 * np.sin(np.outer(t_s, [0.5, 0.37, 0.23]) + np.array([0.0, 1.0, 2.0]))


@pytest.fixture(scope="module")
def walk(tmp_path_factory):
    """A log: clean air, a beacon, a source; every 0.1 s, in millimetres."""
    rng, t_s = np.random.default_rng(1), np.arange(0.0, 200.0, 0.1)
    sources = np.where(t_s[:, None] < 140.0, BEACON_M, SOURCE_M)
    gas = np.where(t_s < 20.0, 0.0, 10.0 / np.linalg.norm(nose_m(t_s) - sources, axis=1))
    sensed = np.zeros_like(t_s)
    for i in range(1, len(t_s)):
        sensed[i] = sensed[i - 1] + (gas[i] - sensed[i - 1]) * (1.0 - np.exp(-0.1 / 0.35))
    ppm = 432.0 + sensed + 3.0 * rng.standard_normal(len(t_s))
    rows = [f"{t:.1f},{x:.1f},{y:.1f},{z:.1f},{c:.1f}" for t, (x, y, z), c in zip(t_s, 1e3 * nose_m(t_s), ppm, strict=True)]
    path = tmp_path_factory.mktemp("log") / "walk.csv"
    path.write_text("\n".join(["t [s],x [mm],y [mm],z [mm],co2 [ppm]", *rows]) + "\n")
    return path


@pytest.fixture(scope="module")
def found(walk):
    """Folder of what the log gives when it calibrates itself."""
    folder = walk.with_name("found")
    assert main([str(walk), *BY_ITSELF, f"out={folder}"]) == 0
    return folder


def place(folder):
    return json.loads((folder / "location.json").read_text())


def test_a_log_calibrates_itself_and_gives_the_source(found):
    told = place(found)
    mean_m, cov_m2 = np.array(told["mean_m"]), np.array(told["cov_m2"])
    error_m = mean_m - SOURCE_M
    assert np.linalg.norm(error_m) < 0.015 and error_m @ np.linalg.solve(cov_m2, error_m) < 7.81  # chi-square, 95 %
    assert told["schema"] == "oio.localise/1" and told["calibrated"] and told["verdict"] == "PASS"
    assert (found / "calibration.yaml").is_file() and (found / "location.png").read_bytes()[:4] == b"\x89PNG"


def test_the_same_command_gives_the_same_bytes(walk, found):
    assert main([str(walk), *BY_ITSELF, f"out={walk.with_name('again')}"]) == 0
    for name in ("location.json", "location.png", "calibration.yaml"):
        assert (walk.with_name("again") / name).read_bytes() == (found / name).read_bytes()


def test_a_calibration_is_used_again(walk, found, capsys):
    out = walk.with_name("kept")
    assert main([str(walk), NOSE, f"calibration={found / 'calibration.yaml'}", "search_s=[139.9,200]", f"out={out}"]) == 0
    assert np.allclose(place(out)["mean_m"], place(found)["mean_m"], atol=1e-9) and not (out / "calibration.yaml").exists()
    assert "verdict: PASS" in capsys.readouterr().out


def test_where_the_nose_was_for_a_while_unknown_it_is_not_guessed(walk, found, capsys):
    """Bridged by a straight line, this hole put the source outside its own 95 % region, and the blame on a second source."""
    lines = walk.read_text().splitlines()
    for i in range(1451, 1651):
        t, *_, ppm = lines[i].split(",")
        lines[i] = f"{t},,,,{ppm}"
    path, out = walk.with_name("hole.csv"), walk.with_name("of_hole")
    path.write_text("\n".join(lines) + "\n")
    assert main([str(path), NOSE, f"calibration={found / 'calibration.yaml'}", "search_s=[140,200]", f"out={out}"]) == 0
    error_m, cov_m2 = np.array(place(out)["mean_m"]) - SOURCE_M, np.array(place(out)["cov_m2"])
    assert np.linalg.norm(error_m) < 0.015 and error_m @ np.linalg.solve(cov_m2, error_m) < 7.81
    assert "1 holes, the longest from 144.9 to 165 s" in capsys.readouterr().out


@pytest.mark.parametrize(("late_s", "what"), [(-0.4, "readings"), (0.4, "positions"), (0.02, "")])
def test_clocks_that_are_apart_are_found_and_reckoned_with(walk, capsys, late_s, what):
    """With positions 0.4 s late the source was 45 mm off, told to 12, and passed."""
    rows = [line.split(",") for line in walk.read_text().splitlines()]
    for row in rows[1:]:
        x, y, z = 1e3 * nose_m(np.array([float(row[0]) - late_s]))[0]
        row[1:4] = [f"{x:.1f}", f"{y:.1f}", f"{z:.1f}"]
    path, out = walk.with_name(f"late{late_s}.csv"), walk.with_name(f"of_late{late_s}")
    path.write_text("\n".join(map(",".join, rows)) + "\n")
    assert main([str(path), *BY_ITSELF, f"out={out}"]) == 0
    said, error_m, cov_m2 = capsys.readouterr().out, np.array(place(out)["mean_m"]) - SOURCE_M, np.array(place(out)["cov_m2"])
    assert np.linalg.norm(error_m) < 0.015 and error_m @ np.linalg.solve(cov_m2, error_m) < 11.3  # chi-square, 99 %
    told = re.search(r"clock: (readings|positions) are stamped ([\d.]+) s late", said)
    assert (told[1] if told else "") == what and (told is None or float(told[2]) == pytest.approx(abs(late_s), abs=0.06))
    if what == "positions":  # live, nobody knows where the nose will be
        with pytest.raises(oio.BadInput, match=r"poses were stamped 0\.\d+ s late"):
            oio.Odometry(oio.load_calibration(out / "calibration.yaml"))
        assert main([str(path), NOSE, f"calibration={out / 'calibration.yaml'}", "search_s=[139.9,199]"]) == 0
    assert main([str(path), *BY_ITSELF, "clock_u_s=-1"]) == 2
    if what == "readings":
        assert main([str(path), *BY_ITSELF, "nominal.delay_s=0.4"]) == 0  # told, and not looked for
        assert "clock: readings are stamped 0.40 s late" in capsys.readouterr().out


def test_glitches_are_left_out_and_told(walk, found, capsys):
    """One reading of 600 put the source 300 mm off."""
    rows = [line.split(",") for line in walk.read_text().splitlines()]
    for i in (300, 1000, 1001, 1700):
        rows[i][4] = "2500.0"
    path, out = walk.with_name("glitches.csv"), walk.with_name("of_glitches")
    path.write_text("\n".join(map(",".join, rows)) + "\n")
    assert main([str(path), *BY_ITSELF, f"out={out}"]) == 0
    said = capsys.readouterr().out
    assert "3 readings are left out as glitches" in said and "one reading is left out as glitches" in said and "verdict: PASS" in said
    assert np.allclose(place(out)["mean_m"], place(found)["mean_m"], atol=0.002)
    assert any("glitches" in note for note in place(out)["read_off_the_file"])
    log = oio.read_log(path, nose_columns=("x [mm]", "y [mm]", "z [mm]"))
    kept = oio.load_calibration(found / "calibration.yaml")
    with pytest.warns(oio.LeftOut, match=r"one reading is left out as glitches: .* at 169\.9 s, 2500 ppm"):
        oio.locate(log.readings.between(139.9, 199.8), log.path, kept)


def test_clocks_further_apart_than_is_looked_for_are_named(walk, capsys):
    """Two seconds, the end of the search taken for the offset, put the source 60 mm off, told to 9."""
    rows = [line.split(",") for line in walk.read_text().splitlines()]
    for row in rows[1:]:
        x, y, z = 1e3 * nose_m(np.array([float(row[0]) + 2.0]))[0]
        row[1:4] = [f"{x:.1f}", f"{y:.1f}", f"{z:.1f}"]
    path = walk.with_name("far.csv")
    path.write_text("\n".join(map(",".join, rows)) + "\n")
    assert main([str(path), *BY_ITSELF]) == 2
    assert "readings seem to be stamped 1.5 s or more later than the poses" in capsys.readouterr().err
    assert main([str(path), *BY_ITSELF, "clock_u_s=1"]) == 0
    assert re.search(r"clock: readings are stamped (1\.9|2\.0)\d* s late", capsys.readouterr().out)


def test_the_answer_is_no_better_than_its_calibration(found, tmp_path):
    text = (found / "calibration.yaml").read_text()
    kept = tmp_path / "kept.yaml"
    kept.write_text(re.sub(r"(?m)^  overall: PASS", "  overall: FAIL", text).replace("reasons: []", 'reasons: ["it never saw gas."]'))
    out = tmp_path / "out"
    assert main([str(found.with_name("walk.csv")), NOSE, f"calibration={kept}", "search_s=[139.9,200]", f"out={out}"]) == 3
    assert place(out)["verdict"] == "FAIL" and "calibration: it never saw gas." in place(out)["reasons"]


def test_positions_of_another_file_are_those_of_one(walk, found):
    """Both stamped since 1970, the positions three times a second and from three seconds before."""
    rows = [line.split(",") for line in walk.read_text().splitlines()[1:]]
    gas, poses = walk.with_name("gas.csv"), walk.with_name("poses.csv")
    gas.write_text("t [s],co2 [ppm]\n" + "".join(f"{1.7e9 + float(t):.1f},{ppm}\n" for t, *_, ppm in rows))
    t_s = np.arange(-3.0, 203.0, 0.03)
    lines = (f"{1.7e9 + t:.2f};{x:.4f};{y:.4f};{z:.4f}\n" for t, (x, y, z) in zip(t_s, nose_m(t_s), strict=True))
    poses.write_text("stamp [s];px [m];py [m];pz [m]\n".replace("stamp", "time") + "".join(lines))
    spans = ("clean_air_s=[3,22.9]", "beacon_m=[0.10,0.05,0]", "beacon_s=[22.9,142.9]")
    out = walk.with_name("apart")
    assert main([str(gas), f"positions={poses}", "nose_columns=[px [m],py [m],pz [m]]", "sensor=ndir", *spans, f"out={out}"]) == 0
    assert np.linalg.norm(np.array(place(out)["mean_m"]) - place(found)["mean_m"]) < 0.003


@pytest.mark.parametrize(("words", "said"), [
    (("positions=none.csv", "nose_columns=[x,y,z]"), "none.csv is no file"),
    (("positions={here}",), "not its columns"),
    (("positions={late}", NOSE), "they have no time in common"),
])  # fmt: skip
def test_wrong_positions_are_refused(walk, capsys, words, said):
    late = walk.with_name("late.csv")
    late.write_text("\n".join(["t [s],x [mm],y [mm],z [mm]", *(f"{1000 + i},1,2,3" for i in range(20))]) + "\n")
    assert main([str(walk), "sensor=ndir", *(word.format(here=walk, late=late) for word in words)]) == 2
    assert said in capsys.readouterr().err


def test_two_readings_are_no_error_but_no_place_either(walk, capsys):
    assert main([str(walk), "sensor=ndir", NOSE, "search_s=[140,140.2]"]) == 3
    assert "verdict: FAIL" in capsys.readouterr().out


def test_a_folder_for_results_is_gone_if_there_are_none(walk, tmp_path, capsys):
    assert main([str(walk), "sensor=ndir", NOSE, "search_s=[500,600]", f"out={tmp_path / 'out'}"]) == 2
    assert not (tmp_path / "out").exists()
    assert main([str(walk), "sensor=ndir", NOSE, "out=/proc/none"]) == 2
    assert "out=/proc/none cannot be made" in capsys.readouterr().err


def test_without_a_calibration_it_does_not_pass(walk, capsys):
    code = main([str(walk), "sensor=ndir", NOSE, "search_s=[140,200]"])
    said = capsys.readouterr().out
    assert f"verdict: { {0: 'WARN', 3: 'FAIL'}[code] }" in said and "There was no calibration" in said
    assert "stage=" not in said and "max_moves" not in said  # keys of a run, which this is not


def test_a_log_that_ends_with_the_beacon_only_calibrates(walk, capsys):
    short = walk.with_name("short.csv")
    short.write_text("\n".join(walk.read_text().splitlines()[:1400]) + "\n")
    out = walk.with_name("calibrated")
    assert main([str(short), *BY_ITSELF[:-1], "beacon_s=[19.9,150]", f"out={out}"]) == 0
    assert [path.name for path in out.iterdir()] == ["calibration.yaml"]
    assert "calibration: verdict" in capsys.readouterr().out


def test_joints_of_an_arm_are_a_path_too(tmp_path, capsys):
    t_s = np.arange(0.0, 20.0, 0.1)
    q = np.stack([0.4 * np.sin(0.5 * t_s), -0.3 + 0.2 * np.sin(0.37 * t_s), 0.6 + 0.2 * np.sin(0.23 * t_s)], axis=1)
    rows = [f"{t:.1f},{a:.5f},{b:.5f},{c:.5f},{0.2 + 5.0 * np.exp(-a * a):.3f}" for t, (a, b, c) in zip(t_s, q, strict=True)]
    path = tmp_path / "arm.csv"
    path.write_text("\n".join(["t [s],pan,lift,elbow,co [ppm]", *rows]) + "\n")
    assert main([str(path), "sensor=ec", "joint_columns=pan,lift,elbow", "position_unit=rad", "columns=co [ppm]"]) in (0, 3)
    assert "source: x" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "text"),
    [
        ((), "one log is localised in at a time"),
        (("sensor=ndir",), "nothing says where the nose was"),
        ((NOSE,), "no sensor was given"),
        (("sensor=ndir", NOSE, "foo.bar=1"), "'foo.bar' is not a key"),
        (("sensor=ndir", NOSE, "nominal.rise_s=-4"), "nominal.rise_s is -4, but 0.001 to 3600 is allowed"),
        (("sensor=ndir", NOSE, "beacon_m=[1,2]"), "clean_air_s=[BEGIN,END]"),
        (("sensor=ndir", NOSE, "clean_air_s=[0,1]"), "Type beacon_m=[X,Y,Z]"),
        (("sensor=ndir", NOSE, "serch_s=[1,2]"), "The nearest that exists is search_s"),
        (("sensor=ndir", NOSE, "search_s=3"), "search_s=3 was given, but it is a list"),
        (("sensor=ndir", NOSE, "search_s=[1,two]"), "two times in seconds"),
        (("sensor=ndir", NOSE, "search_s=[500,600]"), "there is no reading from 500 to 600 s"),
        (("sensor=ndir", NOSE, "out=/"), "/ is there already"),
        (("sensor=ndir", NOSE, f"calibration={__file__}"), "says sensor, arm and profile itself"),
        (("sensor=ndir", NOSE, "calibration=none.yaml"), "calibration=none.yaml was given, but there is no such file"),
        (("sensor=ndir", "nose_columns=[x [mm],x [mm],z [mm]]"), "no column can be two of them"),
        (("sensor=ndir", NOSE, "clock_u_s=soon"), "clock_u_s=soon was given, but it is a number of seconds from 0 to 10"),
        (("sensor=nose", NOSE), "sensor=nose"),
        (("sensor=ndir", "nose_columns=[a,b,c]", "position_unit=m"), "'a'"),
        (("sensor=ndir", "box_m={a: *x}"), "has aliases"),
    ],
)
def test_wrong_input_is_one_paragraph(walk, capsys, words, text):
    assert main([str(walk), *words] if words else []) == 2
    said = capsys.readouterr().err
    assert said.startswith("oio: ") and text in said and said.count("\n") == 1


def test_help(capsys):
    assert main(["--help"]) == 0 and capsys.readouterr().out == HELP


def test_a_stop_ends_it_at_once(walk):
    """Ctrl-C while it fits: nothing but one line, and code 130."""
    line = [sys.executable, "-m", "oio.localise", str(walk), *BY_ITSELF, f"out={walk.with_name('stopped')}"]
    going = subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    time.sleep(2.0)
    going.send_signal(signal.SIGINT)
    said = going.communicate(timeout=30)[1]
    assert going.returncode == 130 and "Traceback" not in said and said.strip().endswith("oio: stopped.")
    assert not walk.with_name("stopped").exists()
