"""Keys that can be typed, and the nearest of them to a mistyped one; what is not read is refused, what an interpolation names is not."""

import random

import pytest
from omegaconf import OmegaConf

from oio.cli.known_keys import known_keys, nearest, owner
from oio.cli.unread_keys import refuse_unread
from oio.core.errors import BadInput
from oio.core.folders import CONF

KEYS = known_keys(CONF)


def test_keys_of_every_place_are_known():
    assert {"seed", "stop.sd_m", "stage.navigate.mapping.remap_factor", "sensor", "backend.log", "bout.window_by_dof"} <= set(KEYS)
    assert not any("_target_" in key or key.startswith("experiment") for key in KEYS)
    assert "stage.navigate.ekf" not in KEYS  # only passes on ekf


def test_a_key_is_nearest_to_itself():
    assert [key for key in KEYS if nearest(key, CONF) != key] == []


def test_two_letters_swapped_are_understood():
    rng = random.Random(0)
    for key in rng.sample(KEYS, 60):
        at = rng.randrange(len(key) - 1)
        swapped = key[:at] + key[at + 1] + key[at] + key[at + 2 :]
        near = nearest(swapped, CONF)
        assert near is not None and (near == key or near.rsplit(".", 1)[-1] == swapped.rsplit(".", 1)[-1]), (key, swapped, near)


@pytest.mark.parametrize("key", ["foo.bar", "qqqq"])
def test_what_is_like_nothing_has_no_nearest(key):
    assert nearest(key, CONF) is None


@pytest.mark.parametrize(
    ("key", "choice"),
    [("backend.log", "replay"), ("stage.navigate.max_moves", "navigate"), ("stage.navigate.max_mvoes", None), ("foo", None)],
)
def test_the_owner_of_a_key_has_all_of_it(key, choice):
    assert owner(key, CONF) == choice


def test_what_an_interpolation_names_is_read(composed):
    for word in ("+mine=0.02", "+my.sd_m=0.02"):
        key = word.strip("+").partition("=")[0]
        with pytest.raises(BadInput, match=f"'{key}' was given, but nothing reads it"):
            refuse_unread(composed(word))
        refuse_unread(composed(word, f"stop.sd_m=${{{key}}}"))


def test_everything_that_is_there_is_read(composed):
    for word in ("dof=5", "backend=recording", "backend=replay", "backend=serial", "+experiment=table_1", "+experiment=paper_literal"):
        refuse_unread(composed(word))
    with pytest.raises(BadInput):
        refuse_unread(OmegaConf.create({"foo": {"bar": []}}))
