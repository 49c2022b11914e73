"""Random numbers as a pure function of (seed, stream, index): Philox 4x32, ten rounds.

No hidden state: a run that is stopped and resumed, or split over workers, draws the same
numbers. One stream per sensor, one index per sample. J. Salmon et al., 'Parallel random
numbers: as easy as 1, 2, 3' (2011).

Logarithm, sine and cosine are series of our own, without branches or calls: in a loop over
members the compiler then computes several of them at once.
"""

import math

import numpy as np

from torquer.compile.engine import bits_float, float_bits, inlined, kernel

_LOW = np.uint64(0xFFFFFFFF)
_32 = np.uint64(32)
_MULTIPLIER_0, _MULTIPLIER_1 = np.uint64(0xD2511F53), np.uint64(0xCD9E8D57)
_WEYL_0, _WEYL_1 = np.uint64(0x9E3779B9), np.uint64(0xBB67AE85)
#: Of a double: exponent of 1.0; of 2^52; mantissa; what moves the border of two exponents from 1
#: to the square root of 2; the bits of the square root of 1/2.
_ONE, _2_52 = np.uint64(0x3FF0000000000000), np.uint64(0x4330000000000000)
_MANTISSA, _MANTISSA_BITS = np.uint64(0x000FFFFFFFFFFFFF), np.uint64(52)
_TO_SQRT_2, _SQRT_HALF = np.uint64(0x00095F619980C433), np.uint64(0x3FE6A09E667F3BCD)
#: 2^52 and the exponent of 1.0, as what stands in the last bits of a number from 2^52 on.
_EXPONENT_OF_ONE = 4503599627370496.0 + 1023.0
_LN_2 = math.log(2.0)


@inlined
def _round(c0, c1, c2, c3, k0, k1):
    p0 = _MULTIPLIER_0 * c0
    p1 = _MULTIPLIER_1 * c2
    words = (p1 >> _32) ^ c1 ^ k0, p1 & _LOW, (p0 >> _32) ^ c3 ^ k1, p0 & _LOW
    return (*words, (k0 + _WEYL_0) & _LOW, (k1 + _WEYL_1) & _LOW)


@inlined
def _five_rounds(c0, c1, c2, c3, k0, k1):
    # a loop here keeps the loop over members from being vectorised: 75 ns a member instead of 7.5
    x = _round(c0, c1, c2, c3, k0, k1)
    x = _round(*x)
    x = _round(*x)
    x = _round(*x)
    return _round(*x)


@inlined
def philox(c0, c1, c2, c3, k0, k1):
    """Four random 32-bit words (as uint64) of a counter and a key of 32-bit words."""
    a, b, c, d, k0, k1 = _five_rounds(c0, c1, c2, c3, k0, k1)
    words = np.uint64(a), np.uint64(b), np.uint64(c), np.uint64(d)
    return _five_rounds(*words, np.uint64(k0), np.uint64(k1))[:4]


@inlined
def _part_of_one(word):
    """A 32-bit word over 2^32."""
    return bits_float(_ONE | (word << np.uint64(20))) - 1.0


@inlined
def _log(u):
    """Natural logarithm of a number above 0: of its mantissa by the series of 2 artanh(s)."""
    bits = float_bits(u) + _TO_SQRT_2
    exponent = bits_float((bits >> _MANTISSA_BITS) | _2_52) - _EXPONENT_OF_ONE
    mantissa = bits_float((bits & _MANTISSA) + _SQRT_HALF)
    s = (mantissa - 1.0) / (mantissa + 1.0)
    z = s * s
    high = 1.0 / 11.0 + z * (1.0 / 13.0 + z * (1.0 / 15.0 + z * (1.0 / 17.0 + z / 19.0)))
    low = 1.0 / 3.0 + z * (1.0 / 5.0 + z * (1.0 / 7.0 + z * (1.0 / 9.0 + z * high)))
    return exponent * _LN_2 + 2.0 * s * (1.0 + z * low)


@inlined
def cos_sin(turns):
    """Cosine and sine of an angle in turns, 0..1: series about the nearest quarter of a turn."""
    quarter = np.floor(4.0 * turns + 0.5)
    r = (4.0 * turns - quarter) * (0.5 * math.pi)
    z = r * r
    s = 1.0 / 6227020800.0 - z * (1.0 / 1307674368000.0 - z / 355687428096000.0)
    s = 1.0 / 5040.0 - z * (1.0 / 362880.0 - z * (1.0 / 39916800.0 - z * s))
    s = r * (1.0 - z * (1.0 / 6.0 - z * (1.0 / 120.0 - z * s)))
    c = 1.0 / 479001600.0 - z * (1.0 / 87178291200.0 - z / 20922789888000.0)
    c = 1.0 / 24.0 - z * (1.0 / 720.0 - z * (1.0 / 40320.0 - z * (1.0 / 3628800.0 - z * c)))
    c = 1.0 - z * (0.5 - z * c)
    half = np.floor(0.5 * quarter)
    is_odd = quarter - 2.0 * half
    sign = 1.0 - 2.0 * (half - 2.0 * np.floor(0.5 * half))
    return sign * (c - is_odd * (c + s)), sign * (s + is_odd * (c - s))


@inlined
def normal3(seed, stream, index):
    """Three independent standard normal numbers of sample `index` of a stream (integers >= 0)."""
    s, i = np.uint64(seed), np.uint64(index)
    a, b, c, d = philox(i & _LOW, i >> _32, np.uint64(stream), np.uint64(0), s & _LOW, s >> _32)
    half = 0.5 / 4294967296.0  # keeps the logarithm finite
    r1 = math.sqrt(-2.0 * _log(_part_of_one(a) + half))
    r2 = math.sqrt(-2.0 * _log(_part_of_one(c) + half))
    cos1, sin1 = cos_sin(_part_of_one(b))
    cos2, _ = cos_sin(_part_of_one(d))
    return (r1 * cos1, r1 * sin1, r2 * cos2)


@inlined
def draw(sigma, seed, stream, sample):
    """Three standard normal numbers for an error of standard deviation sigma; zeros without one."""
    if sigma == 0.0:
        return (0.0, 0.0, 0.0)
    return normal3(seed, stream, sample)


@kernel
def fill_words(seed, stream_high, stream_low, members, out):
    """Pairs of random words out[member, number, 2] of a stream."""
    s, count = np.uint64(seed), out.shape[1]
    high, low = np.uint64(stream_high), np.uint64(stream_low)
    for i in range(members.shape[0]):
        member = np.uint64(members[i])
        for j in range(0, count, 2):
            a, b, c, d = philox(member, np.uint64(j // 2), high, low, s & _LOW, s >> _32)
            out[i, j, 0], out[i, j, 1] = a, b
            if j + 1 < count:
                out[i, j + 1, 0], out[i, j + 1, 1] = c, d
