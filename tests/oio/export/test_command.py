"""`python -m oio.export`: files beside the log, nothing overwritten, one sentence for every mistake."""

import shutil

import pytest

from oio.export.__main__ import WRITERS, main

pytestmark = pytest.mark.long

FILES = {
    "csv": ["tracks.csv", "readings.csv", "joints.csv"],
    "kalibr": ["gas.yaml"],
    "robot_localization": ["ekf.yaml"],
    "tum": ["estimate.tum", "dead_reckoning.tum", "truth.tum"],
}


def test_every_format_is_written_beside_the_log(folder, tmp_path, capsys):
    run = tmp_path / "run"
    run.mkdir()
    shutil.copy(folder / "run.mcap", run / "run.mcap")
    for to, names in FILES.items():
        assert main([str(run if to == "tum" else run / "run.mcap"), "--to", to]) == 0
        assert capsys.readouterr().out.splitlines() == [str(run / to / name) for name in names]
        assert sorted(path.name for path in (run / to).iterdir()) == sorted(names)
    assert set(WRITERS) == {*FILES, "parquet"}
    assert main([str(run), "--to", "tum"]) == 2
    assert "is there already, and results are never overwritten. Type --out" in capsys.readouterr().err
    assert main([str(run), "--to", "tum", "--out", str(tmp_path / "a" / "new")]) == 0


def test_the_same_run_gives_the_same_bytes(folder, tmp_path):
    for name in ("one", "two"):
        assert main([str(folder), "--to", "csv", "--out", str(tmp_path / name)]) == 0
    for name in FILES["csv"]:
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()


def test_an_unfinished_log_is_refused_with_the_command_that_mends_it(folder, tmp_path, capsys):
    part = tmp_path / "run.mcap.part"
    shutil.copy(folder / "run.mcap", part)
    for given in (tmp_path, part):
        assert main([str(given), "--to", "tum"]) == 2
        assert f"`python -m oio.recover {part}`" in capsys.readouterr().err


@pytest.mark.parametrize("to", sorted(FILES))
def test_what_cannot_be_exported_leaves_nothing(logged, tmp_path, to, capsys):
    log = logged()
    code = main([str(log), "--to", to, "--out", str(tmp_path / "out")])
    if to == "csv":
        assert code == 2 and "holds no sample" in capsys.readouterr().err
    assert code == 2 and not (tmp_path / "out").exists()


def test_bad_input(tmp_path, capsys):
    (tmp_path / "file").write_text("no log")
    for given in (tmp_path, tmp_path / "file", tmp_path / "nowhere.mcap"):
        assert main([str(given), "--to", "tum"]) == 2
        said = capsys.readouterr()
        assert "was given as a log, but" in said.err and said.out == ""


def test_a_folder_that_cannot_be_made_is_refused(folder, tmp_path, capsys):
    (tmp_path / "file").write_text("")
    assert main([str(folder), "--to", "tum", "--out", str(tmp_path / "file" / "out")]) == 2
    assert "cannot be written" in capsys.readouterr().err


def test_a_disk_that_is_full_leaves_no_folder_that_looks_complete(folder, tmp_path, capsys, monkeypatch):
    def half_written(run, out):
        (out / "estimate.tum").write_text("half")
        raise OSError(28, "No space left on device")

    monkeypatch.setitem(WRITERS, "tum", half_written)
    assert main([str(folder), "--to", "tum", "--out", str(tmp_path / "new")]) == 2
    assert "No space left on device" in capsys.readouterr().err and not list(tmp_path.iterdir())
