"""The sensor as Kalibr writes an IMU: its reader's rules hold, and the figures are those of calibration.yaml and of the log."""

import numpy as np
import pytest
import yaml

from oio.core.errors import BadInput
from oio.core.records import GasSample
from oio.export.kalibr import write_kalibr
from oio.export.run_record import read_run_record
from oio.results.calibration_entries import read_calibration


@pytest.fixture(scope="module")
def gas(record, tmp_path_factory):
    (path,) = write_kalibr(record, tmp_path_factory.mktemp("kalibr"))
    return yaml.safe_load(path.read_text(encoding="utf-8")), path.read_text(encoding="utf-8")


def test_a_block_per_element_with_the_keys_of_kalibr(gas):
    blocks, text = gas
    assert list(blocks) == ["gas0", "gas1"] and text.startswith("# OIO: gas sensor of run ")
    for block in blocks.values():
        assert list(block) == ["rostopic", "update_rate", "gas_noise_density", "gas_random_walk", "timeshift_gas_joints", "T_gas_link"]
        assert block["rostopic"] == "/gas/ec/sample"
        # what Kalibr's reader of imu.yaml and camchain.yaml asks for
        assert block["update_rate"] > 0.0 and block["gas_noise_density"] > 0.0 and block["gas_random_walk"] > 0.0
        assert isinstance(block["timeshift_gas_joints"], float)
        transform = np.array(block["T_gas_link"])
        assert transform.shape == (4, 4) and np.array_equal(transform[:3, :3], np.eye(3)) and transform[3].tolist() == [0, 0, 0, 1]


def test_the_density_gives_back_the_noise_of_a_reading(gas, folder):
    """Kalibr: sigma of a reading = density * sqrt(update_rate)."""
    quantities = read_calibration(folder).quantities
    for e, block in enumerate(gas[0].values()):
        assert block["gas_noise_density"] ** 2 * block["update_rate"] == pytest.approx(quantities[f"sensor.element_{e}.R_white"].value)
        assert block["update_rate"] == pytest.approx(1.0)  # two elements in turn, at 2 Hz
        assert block["timeshift_gas_joints"] == -quantities["sensor.delay"].value


def test_the_walk_is_that_of_the_filter(gas, folder):
    stored = read_calibration(folder).document["filter"]
    for e, block in enumerate(gas[0].values()):
        assert block["gas_random_walk"] ** 2 == pytest.approx(stored["Q_per_s_diagonal"][stored["states"].index(f"baseline_{e}")])


def test_the_transform_takes_the_nose_to_the_origin(gas, record):
    nose_in_link = np.append(record.arm.chain.nose_offset, 1.0)
    assert (np.array(gas[0]["gas0"]["T_gas_link"]) @ nose_in_link).tolist() == [0.0, 0.0, 0.0, 1.0]


def test_what_is_not_known_is_left_out_and_said(folder, logged, tmp_path):
    document = yaml.safe_load((folder / "calibration.yaml").read_text(encoding="utf-8"))
    del document["filter"]
    attached = {"calibration.yaml": yaml.safe_dump(document).encode()}
    log = logged(*(GasSample(i * 10**9, i % 2, 1.0) for i in range(1, 9)), attachments=attached, versions="{broken")
    (path,) = write_kalibr(read_run_record(log), tmp_path)
    text = path.read_text(encoding="utf-8")
    assert "# gas_random_walk: left out" in text and "# T_gas_link: left out" in text and "of an unknown version" in text
    assert list(yaml.safe_load(text)["gas0"]) == ["rostopic", "update_rate", "gas_noise_density", "timeshift_gas_joints"]


def test_a_log_without_calibration_or_samples_is_refused(folder, logged, tmp_path):
    with pytest.raises(BadInput, match=r"no attachment 'calibration\.yaml'"):
        write_kalibr(read_run_record(logged(GasSample(1, 0, 1.0))), tmp_path)
    (tmp_path / "by_hand.mcap").unlink()
    attached = {"calibration.yaml": (folder / "calibration.yaml").read_bytes()}
    with pytest.raises(BadInput, match="holds 1 samples of element 0, but"):
        write_kalibr(read_run_record(logged(GasSample(1, 0, 1.0), attachments=attached)), tmp_path)
