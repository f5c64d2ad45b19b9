"""Files that a run reads are named with size and SHA-256, as `sha256sum` tells them."""

import hashlib

from oio.cli.input_files import inputs_in_words


def test_a_file_has_its_size_and_sha_256(tmp_path, monkeypatch):
    (tmp_path / "lab.csv").write_bytes(b"t,co2\n0,400\n")
    monkeypatch.setenv("OIO_DATA", str(tmp_path))
    told = inputs_in_words({"recording": {"file": "lab.csv", "unit": "ppm"}, "sensor": {"name": "ec"}})
    assert told == {"lab.csv": f"12 bytes, SHA-256 {hashlib.sha256(b't,co2' + bytes([10]) + b'0,400' + bytes([10])).hexdigest()}"}


def test_a_folder_has_one_hash_that_changes_with_any_byte_or_name(tmp_path):
    folder = tmp_path / "gaden"
    folder.mkdir()
    config = {"air": {"path": str(folder)}}
    (folder / "a").write_text("1")
    (folder / "b").write_text("2")
    first = inputs_in_words(config)
    assert list(first) == [str(folder)] and first[str(folder)].startswith("2 files, ")
    (folder / "b").write_text("33")
    second = inputs_in_words(config)
    (folder / "b").rename(folder / "c")
    (folder / "sub").mkdir()
    third = inputs_in_words(config)
    (folder / "c").rename(folder / "sub" / "c")
    assert inputs_in_words(config) != third
    assert len({first[str(folder)], second[str(folder)], inputs_in_words(config)[str(folder)]}) == 3


def test_a_simulation_reads_no_file():
    assert inputs_in_words({"sensor": {"name": "ec"}, "backend": {"name": "mujoco"}}) == {}
