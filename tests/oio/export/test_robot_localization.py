"""Parameters of robot_localization: its format, and a filter of its kind that runs on them is consistent with the odometry."""

import numpy as np
import pytest
import yaml

from oio.core.errors import BadInput
from oio.core.records import SECOND_NS, GasSample
from oio.export.robot_localization import STATES, velocity_walk, write_robot_localization
from oio.export.run_record import ESTIMATE, read_run_record
from oio.figures.track import TrackOverTime

X, V = slice(0, 3), slice(6, 9)


@pytest.fixture(scope="module")
def parameters(record, tmp_path_factory):
    (path,) = write_robot_localization(record, tmp_path_factory.mktemp("ekf"))
    text = path.read_text(encoding="utf-8")
    assert text.startswith("# OIO: nose odometry of run ") and "# SI units." in text
    return yaml.safe_load(text)["ekf_filter_node"]["ros__parameters"]


def matrix(parameters, name):
    """robot_localization reads 225 floating-point numbers, row by row; ROS 2 refuses lists that mix in whole numbers."""
    assert len(parameters[name]) == STATES**2 and all(isinstance(x, float) for x in parameters[name])
    return np.array(parameters[name]).reshape(STATES, STATES)


def test_the_parameters_have_the_types_that_the_node_declares(parameters):
    assert parameters["odom0"] == "/estimate/odom"
    assert parameters["odom0_config"] == [True] * 3 + [False] * 12
    assert parameters["world_frame"] == parameters["odom_frame"] == "base" and parameters["base_link_frame"] == "nose"
    assert isinstance(parameters["frequency"], float) and parameters["sensor_timeout"] == pytest.approx(2 / parameters["frequency"])
    assert "map_frame" not in parameters and parameters["two_d_mode"] is False


def test_the_matrices_are_covariances(parameters, record):
    for name in ("process_noise_covariance", "initial_estimate_covariance"):
        cov = matrix(parameters, name)
        assert np.array_equal(cov, cov.T) and np.all(np.linalg.eigvalsh(cov) > 0.0)
    assert matrix(parameters, "initial_estimate_covariance")[X, X] == pytest.approx(record.noses[ESTIMATE].cov_m2[0])


def test_a_filter_of_this_kind_is_consistent_with_the_odometry(parameters, record):
    """Predict with P = F P F' + dt Q (src/ekf.cpp), update with the odometry and its covariance: NIS about 3 if Q is in its units."""
    q, p = matrix(parameters, "process_noise_covariance"), matrix(parameters, "initial_estimate_covariance")
    track, x, h, nis = record.noses[ESTIMATE], np.zeros(STATES), np.eye(STATES)[:3], []
    x[:3] = track.p_m[0]
    for i in range(1, len(track)):
        dt, f = track.t_s[i] - track.t_s[i - 1], np.eye(STATES)
        f[X, V] = dt * np.eye(3)
        x, p = f @ x, f @ p @ f.T + dt * q
        s, y = p[X, X] + track.cov_m2[i], track.p_m[i] - x[:3]
        gain = p @ h.T @ np.linalg.inv(s)
        nis.append(y @ np.linalg.solve(s, y))
        x, p = x + gain @ y, (np.eye(STATES) - gain @ h) @ p
    assert 0.5 < np.mean(nis) < 6.0
    assert np.allclose(x[[*range(3, 6), *range(9, 15)]], 0.0)


def test_the_density_of_a_random_walk_is_found(tmp_path):
    rng, q, dt = np.random.default_rng(0), np.array([0.01, 0.04, 0.25]), 0.01
    v = np.cumsum(rng.normal(size=(200_000, 3)) * np.sqrt(q * dt), axis=0)
    t_s = np.arange(len(v)) * dt
    walk = TrackOverTime(t_s, np.cumsum(v * dt, axis=0), np.zeros((len(v), 3, 3)))
    for step_s in (0.2, 1.0):
        assert velocity_walk(walk, step_s)[0] == pytest.approx(q, rel=0.1)


def test_without_odometry_or_an_arm_it_is_refused(logged, tmp_path):
    with pytest.raises(BadInput, match=r"holds no odometry \(/estimate/odom\)"):
        write_robot_localization(read_run_record(logged()), tmp_path)
    (tmp_path / "by_hand.mcap").unlink()
    rows = [(i * SECOND_NS, np.zeros(3), np.eye(3)) for i in range(1, 4)]
    with pytest.raises(BadInput, match="joint states with a model of the arm"):
        write_robot_localization(read_run_record(logged(*(GasSample(t_ns, 0, 1.0) for t_ns, *_ in rows), odometry=rows)), tmp_path)
