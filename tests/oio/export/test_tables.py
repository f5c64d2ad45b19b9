"""Tables: what pandas and PlotJuggler read; back from CSV and Parquet they are the log."""

import csv
import dataclasses
import sys

import numpy as np
import pytest

from oio.core.errors import BadInput
from oio.core.records import GasSample, JointState, seconds
from oio.export.run_record import read_run_record
from oio.export.table_files import write_csv, write_parquet
from oio.export.tables import tables
from oio.log import read_odometry, read_readings, read_samples, read_states


@pytest.fixture(scope="module")
def read_back(record, tmp_path_factory):
    """Columns by table, from CSV."""
    found = {}
    for path in write_csv(record, tmp_path_factory.mktemp("csv")):
        with path.open(encoding="utf-8", newline="") as file:
            heads, *rows = csv.reader(file)
        assert all(len(row) == len(heads) for row in rows) and not any("" in row for row in rows)
        found[path.stem] = dict(zip(heads, np.array(rows, dtype=np.float64).T, strict=True))
    return found


def test_the_time_comes_first_and_ascends(read_back):
    assert list(read_back) == ["tracks", "readings", "joints"]
    for table in read_back.values():
        assert next(iter(table)) == "t_s" and np.all(np.diff(table["t_s"]) > 0.0)


def test_every_column_has_its_unit(read_back):
    units = ("_s", "_m", "_m2", "_ppm", "_rad", "_rad_s", "_rad_s2")
    free = {"element", "raw", "ppm"}  # of the sensor
    assert [head for table in read_back.values() for head in table if not head.endswith(units) and head not in free] == []


def test_joints_are_those_of_the_log(read_back, folder):
    states = [sample for sample in read_samples(folder / "run.mcap") if isinstance(sample, JointState)]
    table = read_back["joints"]
    assert len(table) == 1 + 3 * 3
    for j, name in enumerate(("shoulder_azimuth", "shoulder_elevation", "elbow_tilt")):
        for column, quantity in ((f"{name}_q_rad", "q"), (f"{name}_dq_rad_s", "dq"), (f"{name}_ddq_rad_s2", "ddq")):
            assert np.array_equal(table[column], [getattr(state, quantity)[j] for state in states])


def test_readings_are_those_of_the_log(read_back, folder):
    table, log = read_back["readings"], folder / "run.mcap"
    samples = [sample for sample in read_samples(log) if isinstance(sample, GasSample)]
    readings = {(reading.t_ns, reading.element): reading for reading in read_readings(log)}
    assert np.array_equal(table["raw"], [sample.raw for sample in samples])
    assert np.array_equal(table["ppm"], [readings[sample.t_ns, sample.element].ppm for sample in samples])
    first = table["element"] == 0
    assert np.array_equal(table["element_0_ppm"][first], table["ppm"][first]) and np.all(np.isnan(table["element_0_ppm"][~first]))


def test_tracks_are_those_of_the_log(read_back, folder):
    table, log = read_back["tracks"], folder / "run.mcap"
    at = {t_s: i for i, t_s in enumerate(table["t_s"].tolist())}
    for t_ns, nose, cov in {row[0]: row for row in read_odometry(log)}.values():
        i = at[seconds(t_ns)]
        assert [table[f"estimate_{axis}_m"][i] for axis in "xyz"] == nose.tolist()
        assert table["estimate_cov_xz_m2"][i] == cov[0, 2] and table["estimate_cov_yy_m2"][i] == cov[1, 1]
    names, belief = list(read_states(log))[-1]
    x, z = names.index("source_x"), names.index("source_z")
    i = at[seconds(belief.t_ns)]
    assert table["source_z_m"][i] == belief.mean[z] and table["source_cov_xz_m2"][i] == belief.cov[x, z]
    assert np.sum(np.isfinite(table["truth_ppm"])) == np.sum(np.isfinite(table["truth_x_m"])) > 100


def test_parquet_holds_the_same_and_says_of_which_run(record, read_back, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    for path in write_parquet(record, tmp_path):
        table = parquet.read_table(path)
        assert table.column_names == list(read_back[path.stem])
        assert table.schema.metadata[b"oio"].decode() == record.title
        for name, column in read_back[path.stem].items():
            assert np.array_equal(table[name].to_numpy(), column, equal_nan=True)


def test_without_pyarrow_it_says_what_to_install(record, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(BadInput, match="pip install pyarrow"):
        write_parquet(record, tmp_path)


def test_what_was_not_read_is_nan_and_what_is_not_there_has_no_table(logged):
    made = tables(read_run_record(logged(GasSample(1, 0, 5.0), GasSample(2, 1, 6.0))))
    assert list(made) == ["readings"]
    assert np.all(np.isnan(made["readings"]["ppm"])) and made["readings"]["raw"].tolist() == [5.0, 6.0]


SLIDER = b"""<mujoco><worldbody><body><joint name="pan" type="slide" axis="1 0 0" range="0 1"/><geom size="0.1"/><site name="nose"/></body>
</worldbody></mujoco>"""


def test_a_sliding_joint_is_in_metres(logged):
    log = logged(JointState(10**9, [0.25], [0.1], [0.0]), attachments={"arm.mjcf": SLIDER})
    made = tables(read_run_record(log))
    assert list(made["joints"]) == ["t_s", "pan_q_m", "pan_dq_m_s", "pan_ddq_m_s2"]
    assert made["tracks"]["dead_reckoning_x_m"].tolist() == [0.25]


def test_a_log_that_names_other_joints_is_refused(record):
    with pytest.raises(BadInput, match="names 1 joints, but its joint states have another number"):
        tables(dataclasses.replace(record, identity={**record.identity, "joints": "pan"}))
