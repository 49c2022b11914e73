"""Philox known answers, and what the normal numbers made of it are good for."""

import numpy as np
import pytest
from scipy import stats

from torquer.base.noise import normal3, philox
from torquer.compile.engine import kernel

N = 200_000


@kernel
def block(seed, stream, first, out):
    for i in range(out.shape[0]):
        out[i, 0], out[i, 1], out[i, 2] = normal3(seed, stream, first + i)


def draw(seed, stream, first=0, n=N):
    out = np.empty((n, 3))
    block(seed, stream, first, out)
    return out


def words(text):
    return [np.uint64(int(w, 16)) for w in text.split()]


@pytest.mark.parametrize(
    ("counter", "key", "answer"),
    [
        ("0 0 0 0", "0 0", "6627e8d5 e169c58d bc57ac4c 9b00dbd8"),
        (
            "ffffffff ffffffff ffffffff ffffffff",
            "ffffffff ffffffff",
            "408f276d 41c83b0e a20bc7c6 6d5451fd",
        ),
        (
            "243f6a88 85a308d3 13198a2e 03707344",
            "a4093822 299f31d0",
            "d16cfe09 94fdcceb 5001e420 24126ea1",
        ),
    ],
)
def test_philox_gives_the_published_answers(counter, key, answer):
    assert list(philox(*words(counter), *words(key))) == words(answer)
    plain = getattr(philox, "py_func", philox)
    assert list(plain(*words(counter), *words(key))) == words(answer)


def test_numbers_are_standard_normal_on_every_axis():
    sample = draw(20260101, 1)
    for axis in range(3):
        assert stats.kstest(sample[:, axis], "norm").pvalue > 1e-3
    assert sample.mean(axis=0) == pytest.approx(np.zeros(3), abs=4.0 / np.sqrt(N))
    assert sample.var(axis=0) == pytest.approx(np.ones(3), abs=6.0 / np.sqrt(N))
    assert stats.kurtosis(sample, axis=0) == pytest.approx(np.zeros(3), abs=25.0 / np.sqrt(N))
    assert 4.2 < np.abs(sample).max() < 6.8  # 2^-33 is the least probability it can tell


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ((1, 1, 0), (1, 2, 0)),  # streams
        ((1, 1, 0), (2, 1, 0)),  # seeds
        ((1, 1, 0), (1, 1, 1)),  # neighbours in time
        ((1, 1, 0), (1 + 2**32, 1, 0)),  # the high half of the seed counts
        ((1, 1, 0), (1, 1, 2**32)),  # and that of the index
        ((2**63 - 1, 1, 0), (2**62 - 1, 1, 0)),
    ],
)
def test_streams_seeds_and_samples_are_independent(one, other):
    a, b = draw(*one, n=50_000), draw(*other, n=50_000)
    both = np.corrcoef(np.hstack([a, b]).T) - np.eye(6)
    assert np.abs(both).max() < 5.0 / np.sqrt(50_000)
    squares = np.corrcoef(np.hstack([a, b]).T ** 2) - np.eye(6)
    assert np.abs(squares).max() < 5.0 / np.sqrt(50_000)
    assert not np.any(a == b)


def test_sample_depends_only_on_seed_stream_and_index():
    whole = draw(7, 3, n=1000)
    assert np.array_equal(draw(7, 3, first=400, n=600), whole[400:])
    assert normal3(7, 3, 123) == tuple(whole[123])


def test_samples_do_not_depend_on_the_kind_of_integer():
    for kind in (np.int32, np.int64, np.uint64):
        assert normal3(kind(7), kind(3), kind(123)) == normal3(7, 3, 123)


@pytest.mark.parametrize("place", [(0, 1, 0), (5, 2, 77), (2**63 - 1, 4, 2**40), (2**32, 0, 1)])
def test_compiled_and_plain_python_agree(place):
    plain = getattr(normal3, "py_func", normal3)
    assert plain(*place) == pytest.approx(normal3(*place), rel=1e-14)
