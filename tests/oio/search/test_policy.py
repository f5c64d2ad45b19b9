"""`search=policy`: an observation has what the view has and no more; its network is a small plain file, and wrong files are refused."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from oio.core.errors import BadInput
from oio.core.records import Belief
from oio.search.observation import HYPOTHESES, SNIFFS, observe, shapes
from oio.search.policy import Policy
from oio.search.policy_network import FEATURES, PolicyNetwork, features, load_network
from oio.search.view import Move, View

NETWORK = Path(__file__).resolve().parents[3] / "oio" / "search" / "policy.npz"


@pytest.fixture
def view(lab):
    made = lab(3)
    mean = np.zeros(made.model.size)
    mean[made.model.at["s"]] = 0.3, 0.1, 0.15
    moves = tuple(Move(made.arm.random_pose(np.random.default_rng(i)), 0.1 * i, 2.0**i, None, False) for i in range(8))
    return View(made.arm, made.model, Belief(0, mean, 1e-4 * np.eye(len(mean))), (), moves, 1.0, 0.04)


def test_an_observation_has_its_shapes_and_stays_within_one(view):
    wild = Belief(0, np.full(view.model.size, 1e9), 1e20 * np.eye(view.model.size))
    for seen in (view, replace(view, belief=None, moves=()), replace(view, belief=wild)):
        told = observe(seen)
        assert {name: value.shape for name, value in told.items()} == shapes(view.arm.dof)
        assert all(np.all(np.abs(value) <= 1.0) for value in told.values())


def test_the_latest_sniffs_come_first(view):
    told = observe(view)
    assert np.all(np.diff(told["sniffs"][:, 4]) < 0.0) and told["sniffs"][0, 4] == pytest.approx(0.7)
    few = observe(replace(view, moves=view.moves[:2]))["sniffs"]
    assert np.all(few[2:] == 0.0) and np.all(few[0, 3] > few[1, 3]) and len(few) == SNIFFS


def test_features_are_the_same_wherever_the_whole_scene_is(view):
    told = observe(view)
    moved = {name: np.array(value) for name, value in told.items()}
    for name in ("nose", "source"):
        moved[name] += 0.01
    moved["sniffs"][:, :3] += 0.01
    before, after = features(told), features(moved)
    source = slice(3, 6)
    np.testing.assert_allclose(after[source] - before[source], 0.01)
    np.testing.assert_allclose(np.delete(after, source), np.delete(before, source), atol=1e-12)
    assert before.shape == (FEATURES,) and len(told["hypotheses"]) == HYPOTHESES


def test_the_network_of_the_repository_is_small_and_plain():
    assert NETWORK.stat().st_size < 100_000
    with np.load(NETWORK, allow_pickle=False) as file:
        assert all(file[name].dtype == np.float32 for name in file.files)


def test_a_network_is_read_as_it_was_written(tmp_path):
    rng = np.random.default_rng(0)
    made = PolicyNetwork((rng.standard_normal((4, FEATURES)), rng.standard_normal((3, 4))), (np.ones(4), np.zeros(3)), np.zeros(3))
    made.save(tmp_path / "net.npz")
    x = rng.uniform(-1.0, 1.0, FEATURES)
    np.testing.assert_allclose(load_network(tmp_path / "net.npz").mean(x), made.mean(x), rtol=1e-5, atol=1e-5)
    assert np.all(np.abs(made.drawn(x, rng)) <= 1.0)


def test_files_that_hold_no_network_are_refused(tmp_path):
    (tmp_path / "text.npz").write_text("no archive", encoding="utf-8")
    np.savez(tmp_path / "other.npz", weight_0=np.zeros((2, 5)), bias_0=np.zeros(2), ln_spread=np.zeros(3))
    made = PolicyNetwork((np.full((3, FEATURES), np.nan),), (np.zeros(3),), np.zeros(3))
    made.save(tmp_path / "nan.npz")
    with pytest.raises(BadInput, match="holds numbers that are not finite"):
        load_network(tmp_path / "nan.npz")
    np.savez(tmp_path / "pickled.npz", weight_0=np.array([{}], dtype=object))
    for name in ("text.npz", "other.npz", "pickled.npz", "missing.npz"):
        with pytest.raises(BadInput, match=r"search\.network is .*Type python -m oio\.gym\.train"):
            Policy(network=str(tmp_path / name))
