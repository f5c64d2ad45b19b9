"""The interface against a run: its calibration, its source and, fed sample by sample, its beliefs to the bit."""

import sys
import tempfile
import time
import types

import numpy as np
import pytest

import oio
from oio.cli.build import build
from oio.cli.compose import compose
from oio.estimators import odometry as filters

pytestmark = pytest.mark.long

SHORT = {
    "stage.navigate.max_moves": 15, "stage.map_beliefs.repeats": 2, "stage.map_beliefs.budget_s": 0,
    "stage.calibrate_bouts.moves_per_rung": 2, "stage.navigate.belief_every_s": 0, "stage.evaluate.paper_assembly": False,
    "stage.evaluate.cold_maps": "last", "stage.evaluate.bound_draws": 1,
}  # fmt: skip


@pytest.fixture(scope="module")
def searched(tmp_path_factory):
    """A short run, and the maps of its search: after which joints and readings, of how many moves, thorough or not."""
    maps, plain = [], filters.Odometry.locate

    def noted(self, measurements, made=(), thorough=True):
        maps.append((self, self._joints.t_ns, len(self.trace), measurements, thorough))
        return plain(self, measurements, made, thorough)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(filters.Odometry, "locate", noted)
        folder = tmp_path_factory.mktemp("api") / "run"
        run = oio.simulate("ndir", 3, 3, air="steady", overrides=SHORT, out=folder)
    return types.SimpleNamespace(run=run, folder=folder, maps=[rest for searching, *rest in maps if searching is maps[0][0]])


def test_a_run_is_read_as_it_was_left(searched, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)  # as where it is not installed: structured arrays
    run, again = searched.run, oio.load_run(searched.folder / "run.mcap")
    assert run.summary["seed"] == 3 and run.metadata["sensor"] == "ndir" and list(run.stages)[-1] == "evaluate"
    assert run.verdict == again.verdict == run.summary["verdict"] and again.calibration.text == run.calibration.text
    assert {"t_s", "element", "raw", "ppm", "sigma_ppm"} <= set(run.readings.dtype.names)
    assert sum(name.endswith("_q_rad") for name in run.joints.dtype.names) == 3 and np.all(np.diff(run.joints["t_s"]) > 0)
    last = run.track[np.isfinite(run.track["source_x_m"])][-1]
    believed = [last[f"source_{axis}_m"] for axis in "xyz"]
    assert np.allclose(believed, run.summary["calibrated"]["believed_m"], atol=1e-12)
    with pytest.raises(oio.BadInput, match="this run had warm_up"):
        run.samples("navigtae")


def test_tables_are_data_frames_where_pandas_is_there(searched, monkeypatch):
    pandas = pytest.importorskip("pandas")
    framed = searched.run.readings
    assert isinstance(framed, pandas.DataFrame)
    monkeypatch.setitem(sys.modules, "pandas", None)
    array = searched.run.readings
    assert list(framed.columns) == list(array.dtype.names)
    for name in array.dtype.names:
        np.testing.assert_array_equal(framed[name], array[name])


def test_the_same_source_as_the_run(searched):
    """The run's last map began from its earlier ones, and this from none: the answers agree to what the fit converges to."""
    readings, poses = searched.run.samples()
    found, of_run = oio.locate(readings, poses, searched.run.calibration, measurements=searched.maps[-1][2]), searched.run.summary
    assert np.linalg.norm(found.mean_m - of_run["calibrated"]["believed_m"]) < 0.1 * of_run["calibrated"]["sd_m"]
    assert found.sd_m == pytest.approx(of_run["calibrated"]["sd_m"], rel=0.02)
    assert found.others == () and found.world == "as calibrated" and found.verdict == searched.run.calibration.verdict
    assert all(reason.startswith("calibration: ") for reason in found.reasons)
    assert np.linalg.norm(found.mean_m - of_run["source_position_m"]) < 0.02


def test_fed_by_hand_it_gives_the_beliefs_of_the_log_to_the_bit_and_keeps_up_with_100_hz(searched):
    run, maps = searched.run, list(searched.maps)
    odometry, beliefs, busy_s = oio.Odometry(run.calibration), [], 0.0
    span, joints, gas = run.stages["navigate"], run.columns["joints"], run.columns["readings"]
    q, dq, ddq = (np.stack([v for n, v in joints.items() if f"_{kind}_" in n], axis=1) for kind in ("q", "dq", "ddq"))
    samples = [(t_s, 0, i) for i, t_s in enumerate(joints["t_s"]) if span[0] < t_s <= span[1]]
    samples += [(t_s, 1, i) for i, t_s in enumerate(gas["t_s"]) if span[0] < t_s <= span[1]]
    for t_s, kind, i in sorted(samples):
        began = time.process_time()
        if kind == 0:
            odometry.joints(t_s, q[i], dq[i], ddq[i])
        elif odometry.reading(t_s, raw=gas["raw"][i], element=gas["element"][i]) is not None:
            beliefs.append(odometry.belief)
        busy_s += time.process_time() - began
        while maps and (odometry._filter._joints.t_ns, len(odometry._filter.trace)) == tuple(maps[0][:2]):
            odometry.locate(*maps.pop(0)[2:])
            beliefs.append(odometry.belief)
    assert not maps and len(beliefs) == len(run.beliefs) > 50
    for mine, (names, logged) in zip(beliefs, run.beliefs, strict=True):
        upper = np.triu_indices(len(names))
        assert names == odometry.model.names and mine.t_ns == logged.t_ns
        assert np.array_equal(mine.mean, logged.mean) and np.array_equal(mine.cov[upper], logged.cov[upper])
    assert np.array_equal(odometry.source()[0], run.summary["calibrated"]["believed_m"])
    assert busy_s < 0.01 * len(samples)  # of processor time; it is a tenth of that or less


def test_calibrating_from_arrays_gives_what_the_run_learnt(searched):
    """But for the noise in clean air, of which the run knows that of the warm-up, too."""
    run = searched.run
    gas, joints, known = run.columns["readings"], run.columns["joints"], run.calibration
    q = np.stack([values for name, values in joints.items() if "_q_" in name], axis=1)
    found = oio.calibrate(
        oio.Readings(gas["t_s"], raw=gas["raw"]), oio.JointPath(joints["t_s"], q), (0.33, 0.10, 0.16),
        clean_air_s=run.stages["baseline"], beacon_s=(run.stages["calibrate_bouts"][0], run.stages["map_beliefs"][1]),
        setup=oio.Setup("ndir", 3),
    )  # fmt: skip
    assert found.names == known.names and len(found.units) == len(found.mean) == len(found.cov)
    assert np.all(np.abs(found.mean - known.mean) < 0.3 * np.sqrt(np.diag(known.cov)))
    assert np.allclose(np.diag(found.cov), np.diag(known.cov), rtol=0.3)
    assert found.Q.shape == (len(found.state_names),) * 2 and found.R_ppm2 > 0 and found.delay_s == 0.0
    assert found.law["exponent"][1] > 0 and found.lag_s[1] > found.lag_s[0] > 0 and found.gain == pytest.approx([1.0])
    assert abs(found.offset_ppm[0] - known.offset_ppm[0]) < 3.0
    readings, poses = run.samples()
    assert np.linalg.norm(oio.locate(readings, poses, found).mean_m - run.summary["source_position_m"]) < 0.02


def test_a_calibration_is_kept_to_the_bit_and_a_run_can_begin_with_it(searched, tmp_path):
    known, path = searched.run.calibration, tmp_path / "kept.yaml"
    oio.write_calibration(known, path)
    again = oio.load_calibration(path)
    assert np.array_equal(again.mean, known.mean) and np.array_equal(again.cov, known.cov) and again.verdict == known.verdict
    assert (again.setup.sensor, again.setup.dof, again.setup.arm) == ("ndir", 3, "so101")
    with pytest.raises(oio.BadInput, match="cannot be written: File exists"):
        oio.write_calibration(known, path)
    with pytest.raises(oio.BadInput, match="Give a setup of that sensor"):
        oio.load_calibration(path, oio.Setup("ec", 3))
    with pytest.raises(oio.BadInput, match="dof=3, or calibrate again"):
        oio.load_calibration(path, oio.Setup("ndir", 5))
    composed = compose(["sensor=ndir", "dof=3", f"calibration={path}", "stage=[navigate,evaluate]"], ())
    assert "load_calibration" in build(composed.cfg, composed.choices, []).stages
    path.write_text(path.read_text().replace("sensor: ndir", "sensor: ../ndir"))
    with pytest.raises(oio.BadInput, match="no choice of conf"):
        oio.load_calibration(path)


def test_a_nose_without_an_arm_is_calibrated_and_finds_the_source(searched):
    run = searched.run
    track, gas = run.columns["tracks"], run.columns["readings"]
    there = np.isfinite(track["truth_x_m"])
    path = oio.NosePath(track["t_s"][there], np.stack([track[f"truth_{axis}_m"][there] for axis in "xyz"], axis=1))
    readings = oio.Readings(gas["t_s"], raw=gas["raw"]).between(path.t_s[0], path.t_s[-1])
    beacon_s = run.stages["calibrate_bouts"][0], run.stages["map_beliefs"][1]
    ends = np.linspace(*beacon_s, 26)[1:]
    known = oio.calibrate(
        readings, path, (0.33, 0.10, 0.16), clean_air_s=(1.0, 10.5), beacon_s=beacon_s, measurement_ends_s=ends, setup=oio.Setup("ndir", 3)
    )
    assert known.setup.arm == "gantry" and known.kept.joints == ("x", "y", "z")
    units = dict(zip(known.names, known.units, strict=True))
    assert (units["offset_x"], units["drift_z"], units["ln_gain_0"]) == ("m", "m/s^2", "1")
    span = run.stages["navigate"]
    found = oio.locate(readings.between(*span), path.between(*span), known)
    assert np.linalg.norm(found.mean_m - run.summary["source_position_m"]) < 0.02
    with pytest.raises(oio.BadInput, match="10 or more after the begin"):
        oio.calibrate(readings, path, (0, 0, 0), clean_air_s=(1, 10.5), beacon_s=beacon_s, measurement_ends_s=ends[:9], setup=known.setup)
    with pytest.raises(oio.BadInput, match="Give clean air before"):
        oio.calibrate(readings, path, (0, 0, 0), clean_air_s=(1, 20), beacon_s=beacon_s, setup=known.setup)
    with pytest.raises(oio.BadInput, match="element 0 has 1 readings"):
        oio.calibrate(readings, path, (0, 0, 0), clean_air_s=(1.0, 1.1), beacon_s=beacon_s, setup=known.setup)


def test_without_out_nothing_is_left_on_the_disk(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    run = oio.simulate("ndir", 3, stage=["warm_up", "baseline"])
    assert list(run.stages) == ["warm_up", "baseline"] and run.calibration is None and len(run.readings) > 50
    assert list(tmp_path.iterdir()) == []
