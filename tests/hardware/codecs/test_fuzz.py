"""Random bytes: nothing is raised, memory stays bounded, and no more is accepted than the checks' lengths allow."""

import pytest
from scipy.stats import poisson

from hardware.codecs import line, scd4x

QUICK, LONG = 200_000, 10_000_000  # bytes
SURE = 1e-9  # the probability that a right codec fails here; the seed is fixed, so it fails always or never


def swallowed(framer, stream: bytes, rng, longest: int) -> list:
    """All frames of the stream, fed in pieces of any size; checks the memory behind each."""
    found, at = [], 0
    while at < len(stream):
        step = int(rng.integers(1, 8192))
        found += framer.feed(stream[at : at + step])
        assert framer.held <= longest + 1
        at += step
    found += framer.flush()
    assert framer.held == 0
    return found


def uniform(codec, size: int, rng) -> None:
    stream = rng.bytes(size)
    mean = len(codec.head.findall(stream)) * codec.odds
    framer = codec.framer()
    found = swallowed(framer, stream, rng, codec.longest)
    assert framer.good == len(found)
    print(f"{codec}: {len(found)} of {size} random bytes accepted, {mean:.2g} expected")
    assert len(found) <= poisson.ppf(1 - SURE, mean)
    assert all(codec.encode(frame)[1:] in stream for frame in found)


def faked(codec, size: int, rng) -> None:
    """Frames with right heads and lengths, whose checks are random."""
    stream, fakes = bytearray(), 0
    while len(stream) < size:
        stream += codec.fake(rng.bytes(int(rng.integers(8, 40)))) + rng.bytes(int(rng.integers(0, 3)))
        fakes += 1
    mean = fakes * codec.fake_odds
    framer = codec.framer()
    found = swallowed(framer, bytes(stream), rng, codec.longest)
    print(f"{codec}: {len(found)} of {fakes} fakes accepted, {mean:.3g} expected, {framer.corrupt} counted as corrupt")
    assert framer.good == len(found)
    assert poisson.ppf(SURE, 0.9 * mean) <= len(found) <= poisson.ppf(1 - SURE, 1.1 * mean)  # heads in the random bytes: a tenth
    assert framer.corrupt > fakes / 2


def test_random_bytes(codec, rng):
    uniform(codec, QUICK, rng)


def test_frames_with_random_checks(codec, rng):
    faked(codec, QUICK, rng)


@pytest.mark.slow
def test_ten_million_random_bytes(codec, rng):
    uniform(codec, LONG, rng)


@pytest.mark.slow
def test_ten_million_bytes_of_frames_with_random_checks(codec, rng):
    faked(codec, LONG, rng)


def words(size: int, rng) -> None:
    stream = rng.bytes(size)
    found = [at for at in range(0, size - 2, 3) if scd4x.unpacked(stream[at : at + 3]) is not None]
    mean = size / 3 / 256
    assert poisson.ppf(SURE, mean) <= len(found) <= poisson.ppf(1 - SURE, mean)


def test_random_words(rng):
    words(QUICK, rng)


@pytest.mark.slow
def test_ten_million_bytes_of_random_words(rng):
    words(LONG, rng)


def commands(size: int, rng) -> None:
    """Commands have no check: every line comes out, at most 16 characters, and a device may repeat it in a sentence."""
    found = swallowed(line.Commands(), rng.bytes(size), rng, line.LONGEST_COMMAND + 1)
    assert len(found) > size / 600
    for text in found:
        assert line.Lines().feed(line.sentence("NAK", text)) == [("NAK", text)]


def test_random_commands(rng):
    commands(QUICK, rng)


@pytest.mark.slow
def test_ten_million_bytes_of_random_commands(rng):
    commands(LONG, rng)
