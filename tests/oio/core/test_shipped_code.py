"""Compiled code of a wheel becomes the cache of an install, for its place and its processor."""

import pickle
import shutil

import pytest

from oio.core import shipped_code
from oio.core.compiled import cache_folder
from oio.core.folders import ROOT
from oio.kinematics import forward


@pytest.fixture
def packed(tmp_path):
    """What numba keeps of the kinematics, packed as for a wheel."""
    forward._copy(*(forward.np.zeros((3, 3)) for _ in range(2)))  # compiled here, if nothing else was
    assert shipped_code.pack(cache_folder(), tmp_path / "packed") >= 2
    return tmp_path / "packed"


def keys(index):
    return shipped_code.read_index(index.read_bytes())[2]


def here():
    return shipped_code.cpu_target.target_context.codegen().magic_tuple()


def test_it_is_packed_by_the_folders_of_its_sources(packed):
    folders = {path.parent.relative_to(packed) for path in packed.rglob("*.nbi")}
    assert "oio/kinematics" in {folder.as_posix() for folder in folders}
    assert all((ROOT / folder).is_dir() for folder in folders)


def test_unpacked_it_is_where_numba_looks_for_it(packed, tmp_path):
    shipped_code.unpack(packed, tmp_path / "cache")
    whole = [path.relative_to(tmp_path / "cache") for path in (tmp_path / "cache").rglob("*.nb?")]
    assert whole and all((cache_folder() / path).is_file() for path in whole)
    read = {path.name: keys(tmp_path / "cache" / path) for path in whole if path.suffix == ".nbi"}
    given = {path.name: keys(path) for path in packed.rglob("*.nbi")}
    assert read.keys() == given.keys()
    for name, found in given.items():
        if {processor for _, processor, _ in found} == {here()}:  # this cache may have code for others too
            assert read[name] == found


def test_its_index_names_this_processor(packed):
    """Compiled for another kind of processor, it would not be found."""
    index = next(packed.rglob("forward._copy*.nbi"))
    (signature, _, hashes), name = next(iter(keys(index).items()))
    version, stamp, _ = shipped_code.read_index(index.read_bytes())
    elsewhere = {(signature, ("a triple", shipped_code.PROCESSOR, ""), hashes): name}
    foreign = index.with_name("foreign.nbi")
    foreign.write_bytes(pickle.dumps(version) + pickle.dumps((stamp, elsewhere)))
    foreign.write_bytes(shipped_code.for_this_processor(foreign.read_bytes()))
    assert keys(foreign) == {(signature, here(), hashes): name}


def test_what_was_compiled_here_is_kept(packed, tmp_path):
    shipped_code.unpack(packed, tmp_path / "cache")
    index = next((tmp_path / "cache").rglob("forward._copy*.nbi"))
    code = next(index.parent.glob(f"{index.stem}.*.nbc"))
    code.write_bytes(b"mine")
    shipped_code.unpack(packed, tmp_path / "cache")
    assert code.read_bytes() == b"mine"


def test_only_code_of_these_sources_is_used(packed, monkeypatch, tmp_path):
    cache = tmp_path / "cache"
    cache.mkdir()
    monkeypatch.setattr(shipped_code, "cache_folder", lambda: cache)
    monkeypatch.setattr(shipped_code, "complete_mark", lambda: cache / "complete")
    monkeypatch.setattr(shipped_code, "SHIPPED", tmp_path / "shipped")
    monkeypatch.setattr(shipped_code, "runs_here", lambda: True)
    shutil.copytree(packed, tmp_path / "shipped" / shipped_code.name_of("0" * 16))
    assert not shipped_code.use_shipped() and not any(cache.iterdir())
    shutil.copytree(packed, tmp_path / "shipped" / shipped_code.name_of(cache.name))
    assert shipped_code.use_shipped() and (cache / "complete").exists() and list(cache.rglob("*.nbc"))
    shutil.rmtree(tmp_path / "shipped")
    assert shipped_code.use_shipped()  # as was done before


@pytest.mark.parametrize("key", ["CPU_NAME", "CPU_FEATURES", "DISABLE_JIT"])
def test_what_the_user_asks_of_numba_goes_first(monkeypatch, key):
    monkeypatch.setattr(shipped_code.NUMBA, key, "generic" if key != "DISABLE_JIT" else 1)
    assert not shipped_code.runs_here()


def test_a_lesser_processor_compiles_for_itself(monkeypatch):
    monkeypatch.setattr(shipped_code.platform, "machine", lambda: shipped_code.MACHINE)
    for key, value in (("CPU_NAME", None), ("CPU_FEATURES", None), ("DISABLE_JIT", 0)):
        monkeypatch.setattr(shipped_code.NUMBA, key, value)
    has = dict.fromkeys(shipped_code.NEEDS, True)
    monkeypatch.setattr(shipped_code.llvmlite.binding, "get_host_cpu_features", lambda: has)
    assert shipped_code.runs_here()
    has["avx2"] = False
    assert not shipped_code.runs_here()
