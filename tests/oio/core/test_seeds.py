"""Three streams, each with a generator per purpose: none shifts another."""

import itertools

import numpy as np
import pytest

from oio.core.errors import BadInput
from oio.core.seeds import Seeds

STREAMS = ("truth", "disturbance", "measurement")


def seeds(truth=3, disturbance=3, measurement=3):
    return Seeds(truth=truth, disturbance=disturbance, measurement=measurement)


def drawn(made, stream, purpose="air", n=4):
    return made.rng(stream, purpose).standard_normal(n)


def test_the_same_seed_gives_the_same_numbers():
    for stream in STREAMS:
        np.testing.assert_array_equal(drawn(seeds(), stream), drawn(seeds(), stream))


def test_equal_seeds_give_streams_and_purposes_of_their_own():
    values = [drawn(seeds(), stream, purpose, 1)[0] for stream in STREAMS for purpose in ("air", "sensor", "source")]
    assert len(set(values)) == 9


def test_streams_are_not_correlated():
    draws = [drawn(seeds(), stream, "air", 20_000) for stream in STREAMS]
    for a, b in itertools.combinations(draws, 2):
        assert abs(np.corrcoef(a, b)[0, 1]) < 4 / np.sqrt(20_000)


def test_neighbouring_seeds_are_not_correlated():
    a, b = (drawn(seeds(truth=s), "truth", "air", 20_000) for s in (0, 1))
    assert abs(np.corrcoef(a, b)[0, 1]) < 4 / np.sqrt(20_000)


@pytest.mark.parametrize("changed", STREAMS)
def test_a_seed_changes_its_stream_alone(changed):
    other = seeds(**{changed: 4})
    for stream in STREAMS:
        assert np.array_equal(drawn(seeds(), stream), drawn(other, stream)) == (stream != changed)


def test_drawing_for_one_purpose_does_not_shift_another():
    made = seeds()
    made.rng("truth", "specimen").standard_normal(100)
    np.testing.assert_array_equal(drawn(made, "truth", "source"), drawn(seeds(), "truth", "source"))


def test_negative_seeds_are_refused():
    with pytest.raises(BadInput, match="truth is -1"):
        seeds(truth=-1)
