"""Random numbers as a pure function of (seed, stream, index): Philox 4x32, ten rounds.

No hidden state: a run that is stopped and resumed, or split over workers, draws the same
numbers. One stream per sensor, one index per sample. J. Salmon et al., 'Parallel random
numbers: as easy as 1, 2, 3' (2011).
"""

import math

import numpy as np

from torquer.engine import kernel

_LOW = np.uint64(0xFFFFFFFF)
_32 = np.uint64(32)
_MULTIPLIER_0, _MULTIPLIER_1 = np.uint64(0xD2511F53), np.uint64(0xCD9E8D57)
_WEYL_0, _WEYL_1 = np.uint64(0x9E3779B9), np.uint64(0xBB67AE85)


@kernel
def philox(c0, c1, c2, c3, k0, k1):
    """Four random 32-bit words (as uint64) of a counter and a key of 32-bit words."""
    for _ in range(10):
        p0 = _MULTIPLIER_0 * c0
        p1 = _MULTIPLIER_1 * c2
        c0, c1, c2, c3 = (p1 >> _32) ^ c1 ^ k0, p1 & _LOW, (p0 >> _32) ^ c3 ^ k1, p0 & _LOW
        k0 = (k0 + _WEYL_0) & _LOW
        k1 = (k1 + _WEYL_1) & _LOW
    return c0, c1, c2, c3


@kernel
def normal3(seed, stream, index):
    """Three independent standard normal numbers of sample `index` of a stream (integers >= 0)."""
    s, i = np.uint64(seed), np.uint64(index)
    a, b, c, d = philox(i & _LOW, i >> _32, np.uint64(stream), np.uint64(0), s & _LOW, s >> _32)
    unit = 1.0 / 4294967296.0  # of 2^32; the half keeps the logarithm finite
    r1 = math.sqrt(-2.0 * math.log((float(a) + 0.5) * unit))
    r2 = math.sqrt(-2.0 * math.log((float(c) + 0.5) * unit))
    phi = 2.0 * math.pi * unit * float(b)
    return (r1 * math.cos(phi), r1 * math.sin(phi), r2 * math.cos(2.0 * math.pi * unit * float(d)))
