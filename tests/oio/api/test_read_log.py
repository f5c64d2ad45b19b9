"""`oio.read_log`: readings and the path of the nose from a table or an MCAP log, as `calibrate` and `locate` take them."""

import numpy as np
import pytest

import oio
from oio.inspect.__main__ import main
from tests.oio.log.ros2_bag import ros2_log

SOURCE_M = np.array([0.12, -0.08, 0.05])
T_S = np.arange(0.0, 60.0, 0.1)
NOSE_M = 0.25 * np.sin(np.outer(T_S, [0.5, 0.37, 0.23]) + np.array([0.0, 1.0, 2.0]))


@pytest.fixture
def table(tmp_path):
    """A log of a nose moved by hand in steady air, in mm and ms, with a lag of 0.3 s and two rows without a number."""
    gas = 30.0 / np.linalg.norm(NOSE_M - SOURCE_M, axis=1)
    sensed = np.zeros_like(gas)
    for i in range(1, len(T_S)):
        sensed[i] = sensed[i - 1] + (gas[i - 1 : i + 1].mean() - sensed[i - 1]) * (1.0 - np.exp(-0.1 / 0.3))
    ppm = 420.0 + sensed + 3.0 * np.random.default_rng(0).standard_normal(len(T_S))
    rows = [
        f"{100 * i};{x:.2f};{y:.2f};{z:.2f};{value:.1f};21.5;45" for i, ((x, y, z), value) in enumerate(zip(1e3 * NOSE_M, ppm, strict=True))
    ]
    rows[7], rows[9] = rows[7].replace(rows[7].split(";")[4], "err"), rows[9].replace(rows[9].split(";")[4], "")
    path = tmp_path / "by_hand.csv"
    path.write_text("\n".join(["millis;x_mm;y_mm;z_mm;co2_ppm;temp_degC;rh_pct", *rows]), encoding="utf-8")
    return path


def test_a_source_is_found_from_a_table_alone(table):
    log = oio.read_log(table, nose_columns=["x_mm", "y_mm", "z_mm"])
    assert len(log.readings) == 598 and log.dropped == {"not a number": 2} and log.climate.shape == (598, 2)
    np.testing.assert_allclose(log.path.q, NOSE_M, atol=1e-5)  # a dropped reading costs no position
    found = oio.locate(log.readings, log.path, setup=oio.Setup(sensor="ndir"))
    assert np.linalg.norm(found.mean_m - SOURCE_M) < 0.01


def placed(table, place):
    """The lines of the log, with the nose at this place (3 cells) for ten seconds."""
    lines = table.read_text(encoding="utf-8").splitlines()
    for i in range(201, 301):
        cells = lines[i].split(";")
        lines[i] = ";".join([cells[0], *place, *cells[4:]])
    return lines


def test_readings_in_a_hole_of_the_path_are_left_out_and_the_hole_is_named(table):
    """A straight line from one end of a hole to the other would put the nose where it was not."""
    table.write_text("\n".join(placed(table, ["", "", ""])), encoding="utf-8")
    log = oio.read_log(table, nose_columns=["x_mm", "y_mm", "z_mm"])
    np.testing.assert_allclose(log.holes_s, [[19.9, 30.0]], atol=1e-9)
    t_s = np.asarray(log.readings.t_s)
    assert len(t_s) == len(log.climate) == 498 and not np.any((t_s > 19.95) & (t_s < 29.95))
    assert any("holes, the longest from 19.9 to 30 s: 100 rows of readings" in note for note in log.notes)
    found = oio.locate(log.readings, log.path, setup=oio.Setup(sensor="ndir"))
    assert np.linalg.norm(found.mean_m - SOURCE_M) < 0.015


def test_a_log_that_is_written_while_the_nose_moves_has_no_holes(table):
    lines = placed(table, table.read_text(encoding="utf-8").splitlines()[200].split(";")[1:4])
    kept = [line for i, line in enumerate(lines) if not 201 < i < 300]  # at rest from 19.9 s to 29.8 s, without rows
    table.write_text("\n".join(kept), encoding="utf-8")
    assert not len(oio.read_log(table, nose_columns=["x_mm", "y_mm", "z_mm"]).holes_s)


def test_readings_and_joints_of_a_bag_keep_their_own_rates_and_one_clock(tmp_path):
    pytest.importorskip("mcap_ros2")
    ros2_log(tmp_path / "bag.mcap")
    joints = [f"/joint_states.position.{name}" for name in ("pan", "lift")]
    log = oio.read_log(tmp_path / "bag.mcap", columns=["/co2.data"], unit="ppm", joint_columns=joints, position_unit="rad")
    assert isinstance(log.path, oio.JointPath) and len(log.path.t_s) == 2000 and len(log.readings) == 40
    assert log.path.t_s[0] == 0.0 and log.readings.t_s[0] == pytest.approx(0.001, abs=3e-7)
    assert log.path.q[100].tolist() == [np.sin(1.0), 0.1]  # in the order that was asked for


def test_two_elements_are_readings_of_their_own(tmp_path):
    path = tmp_path / "pair.csv"
    path.write_text("t_s,co2_ppb_a,co2_ppb_b\n0,1000,2000\n1,1000,3000\n", encoding="utf-8")
    log = oio.read_log(path)
    assert log.readings.t_s.tolist() == [0, 0, 1, 1] and log.readings.element.tolist() == [0, 1, 0, 1]
    assert log.readings.ppm.tolist() == [1, 2, 1, 3] and log.path is None and log.climate is None
    assert any(note.startswith("columns: co2_ppb_a") for note in log.notes)


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"nose_columns": ["x_mm", "y_mm"]}, "nose_columns has 2 names"),
        ({"nose_columns": ["x_mm", "y_mm", "q_mm"]}, r"no column \['q_mm'\]"),
        ({"nose_columns": ["x_mm", "y_mm", "rh_pct"]}, "unit of the positions is not certain: it is '%' of 'rh_pct'"),
        ({"nose_columns": ["x_mm", "y_mm", "z_mm"], "position_unit": "deg"}, "it is 'deg'.*Type position_unit=m, mm, cm"),
        ({"nose_columns": ["x_mm", "y_mm", "z_mm"], "joint_columns": ["x_mm"]}, "were both given"),
        ({"nose": ["x_mm"]}, "'nose' is no key of a mapping"),
        ({"position_unit": "inch"}, "it can be m, mm, cm, rad, deg"),
    ],
)
def test_what_is_wrong_is_refused(table, keys, said):
    with pytest.raises(oio.BadInput, match=said):
        oio.read_log(table, **keys)


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(oio.BadInput, match="is no file"):
        oio.read_log(tmp_path / "none.csv")


def test_a_log_of_a_run_is_a_table_too(tmp_path, capsys):
    run = oio.simulate(sensor="ndir", dof=1, stage=["warm_up", "baseline"], out=tmp_path / "run")
    (file,) = (tmp_path / "run").rglob("*.mcap")
    assert main([str(file), "columns=[/gas/ndir/sample.raw]", "unit=ppm"]) == 0
    assert "'log_time [ns]' (ns)" in capsys.readouterr().out
    log = oio.read_log(
        file,
        columns=["/gas/ndir/sample.raw"],
        unit="ppm",
        joint_columns=["/arm/joint_states.joints.shoulder_azimuth.position"],
        position_unit="rad",
    )
    assert len(log.readings) == len(run.readings) and len(log.path.t_s) == len(run.joints)
