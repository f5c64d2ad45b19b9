"""TUM files are what evo reads: eight numbers a line, stamps that ascend, every digit of the log."""

import numpy as np
import pytest

from oio.core.records import Truth, seconds
from oio.export.tum import write_tum
from oio.log import read_odometry, read_samples


@pytest.fixture(scope="module")
def tum(record, tmp_path_factory):
    """Poses (k, 8) by the name of the file, and the text of one."""
    paths = write_tum(record, tmp_path_factory.mktemp("tum"))
    return {path.stem: np.loadtxt(path, comments="#", ndmin=2) for path in paths}, paths[0].read_text(encoding="utf-8")


def test_one_file_per_track(tum):
    tracks, text = tum
    assert list(tracks) == ["estimate", "dead_reckoning", "truth"]
    first, second = text.splitlines()[:2]
    assert first.startswith("# OIO: estimate of the nose, run ") and "sensor ec" in first and "made by OIO 0." in first
    assert second.startswith("# t [s since the world opened] x y z [m, frame base]")
    assert "nan" not in text and all(len(line.split(" ")) == 8 for line in text.splitlines()[2:])


def test_every_stamp_comes_once_and_the_rotation_is_one(tum):
    for track in tum[0].values():
        assert track.shape[1] == 8 and np.all(np.diff(track[:, 0]) > 0.0)
        assert np.all(track[:, 4:] == [0.0, 0.0, 0.0, 1.0])


def test_the_estimate_is_the_odometry_of_the_log_to_the_last_digit(tum, folder):
    last = {seconds(t_ns): nose for t_ns, nose, _ in read_odometry(folder / "run.mcap")}  # the last at a stamp is what holds
    track = tum[0]["estimate"]
    assert track[:, 0].tolist() == list(last)
    assert np.array_equal(track[:, 1:4], np.array(list(last.values())))


def test_the_truth_is_that_of_the_log_to_the_last_digit(tum, folder):
    truths = [sample for sample in read_samples(folder / "run.mcap") if isinstance(sample, Truth)]
    assert np.array_equal(tum[0]["truth"][:, 0], [seconds(truth.t_ns) for truth in truths])
    assert np.array_equal(tum[0]["truth"][:, 1:4], [truth.nose_m for truth in truths])


def test_tracks_share_stamps(tum):
    """evo compares poses that are at most 10 ms apart."""
    tracks = tum[0]
    shared = np.intersect1d(tracks["estimate"][:, 0], tracks["truth"][:, 0])
    assert len(shared) > 0.5 * len(tracks["estimate"])
    assert set(tracks["truth"][:, 0]) <= set(tracks["dead_reckoning"][:, 0])
    at = [np.flatnonzero(np.isin(tracks[name][:, 0], shared)) for name in ("estimate", "truth")]
    apart_m = np.linalg.norm(tracks["estimate"][at[0], 1:4] - tracks["truth"][at[1], 1:4], axis=1)
    assert np.sqrt(np.mean(apart_m**2)) < 0.1
