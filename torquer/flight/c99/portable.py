"""Sine, cosine and inverse tangent whose bits do not depend on a C library: kernels for the export.

Libraries of C differ in the last bits of these functions, so a board whose library is not that of
the simulation takes other bits. Here they are computed in pairs of doubles (a number and what it
lacks, about 100 bits), by sums and products alone, and rounded once: the answer is the double
nearest to the true value but for about one argument in 10^8 or more. So it equals that of any
library that rounds correctly. T. J. Dekker, 'A floating-point technique for extending the available
precision' (1971).
"""

import math
from fractions import Fraction

import numpy as np

#: Splits a double into two halves of 26 bits.
_SPLITTER = 134217729.0
#: Quarter of a turn: pieces of 25 bits, so that products with whole numbers to 2^27 are exact.
_QUARTER_1, _QUARTER_2 = 1.5707963109016418, 1.5893254712295857e-08
_QUARTER_3, _QUARTER_4 = 6.123233932053594e-17, 6.36831716351095e-25
#: Half of a turn and a quarter of it, as pairs.
_PI = (3.141592653589793, 1.2246467991473532e-16)
_HALF_PI = (1.5707963267948966, 6.123233995736766e-17)
#: Largest angle that is reduced exactly [rad].
_LARGEST_RAD = 134217728.0
_TINY, _HUGE_RATIO = 2.0**-30, 2.0**-60
#: Lengths beyond which points are brought nearer to 1, and by how much.
_LARGEST, _LEAST, _DOWN, _UP = 2.0**500, 2.0**-500, 2.0**-600, 2.0**600


def _pair(value: Fraction) -> tuple[float, float]:
    high = float(value)
    return high, float(value - Fraction(high))


#: Coefficients of the series from the third on, as pairs: of sine, of cosine.
_S3, _S5, _S7, _S9 = (_pair(Fraction((-1) ** (n // 2), math.factorial(n))) for n in (3, 5, 7, 9))
_C4, _C6, _C8, _C10 = (_pair(Fraction((-1) ** (n // 2), math.factorial(n))) for n in (4, 6, 8, 10))


def _sum(a, b):
    """Sum of two numbers, the larger one first, and what it lacks."""
    total = a + b
    return total, b - (total - a)


def _exact_sum(a, b):
    """Sum of two numbers and what it lacks."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


def _product(a, b):
    """Product of two numbers and what it lacks."""
    c, d = _SPLITTER * a, _SPLITTER * b
    a_high, b_high = c - (c - a), d - (d - b)
    a_low, b_low = a - a_high, b - b_high
    whole = a * b
    return whole, ((a_high * b_high - whole) + a_high * b_low + a_low * b_high) + a_low * b_low


def _plus(a, b):
    """Sum of two pairs."""
    high, low = _exact_sum(a[0], b[0])
    further, rest = _exact_sum(a[1], b[1])
    high, low = _sum(high, low + further)
    return _sum(high, low + rest)


def _times(a, b):
    """Product of two pairs."""
    high, low = _product(a[0], b[0])
    return _sum(high, low + (a[0] * b[1] + a[1] * b[0]))


def _negative(a):
    return (-a[0], -a[1])


def _sine_series(r):
    """Sine of a pair within an eighth of a turn: its series."""
    z = _times(r, r)
    x = z[0]
    low = 1.0 / 121645100408832000.0 - x / 51090942171709440000.0
    low = 1.0 / 1307674368000.0 - x * (1.0 / 355687428096000.0 - x * low)
    low = -1.0 / 39916800.0 + x * (1.0 / 6227020800.0 - x * low)
    s = _plus(_S9, (x * low, 0.0))
    s = _plus(_S5, _times(z, _plus(_S7, _times(z, s))))
    s = _times(z, _plus(_S3, _times(z, s)))
    return _plus(r, _times(r, s))


def _cosine_series(r):
    """Cosine of a pair within an eighth of a turn: its series."""
    z = _times(r, r)
    x = z[0]
    low = 1.0 / 2432902008176640000.0 - x / 1124000727777607680000.0
    low = 1.0 / 20922789888000.0 - x * (1.0 / 6402373705728000.0 - x * low)
    low = 1.0 / 479001600.0 - x * (1.0 / 87178291200.0 - x * low)
    c = _plus(_C10, (x * low, 0.0))
    c = _plus(_C6, _times(z, _plus(_C8, _times(z, c))))
    c = _times(z, _plus(_C4, _times(z, c)))
    return _plus((1.0, 0.0), _times(z, _plus((-0.5, 0.0), c)))


def _reduce(x):
    """The quarter of a turn (0 to 3) nearest to an angle, and its distance from it as a pair."""
    angle = x
    if math.fabs(x) > _LARGEST_RAD:  # the same everywhere, no longer exact
        angle = math.fmod(x, 6.283185307179586)
    count = float(np.floor(angle * 0.6366197723675814 + 0.5))
    r = _exact_sum(angle, -count * _QUARTER_1)
    r = _plus(r, (-count * _QUARTER_2, 0.0))
    r = _plus(r, (-count * _QUARTER_3, 0.0))
    r = _plus(r, (-count * _QUARTER_4, 0.0))
    return count - 4.0 * float(np.floor(0.25 * count)), r


def portable_sin(x):
    """Sine of an angle [rad]."""
    if math.fabs(x) < _TINY or math.isnan(x):
        return x
    if math.isinf(x):
        return math.nan
    quarter, r = _reduce(x)
    s = _sine_series(r) if quarter == 0.0 or quarter == 2.0 else _cosine_series(r)
    return -s[0] if quarter >= 2.0 else s[0]


def portable_cos(x):
    """Cosine of an angle [rad]."""
    if math.isinf(x) or math.isnan(x):
        return math.nan
    quarter, r = _reduce(x)
    c = _cosine_series(r) if quarter == 0.0 or quarter == 2.0 else _sine_series(r)
    return -c[0] if quarter == 1.0 or quarter == 2.0 else c[0]


def _first_guess(t):
    """Inverse tangent of 0 to 1 to nine digits: the series at half the angle."""
    half = t / (1.0 + math.sqrt(1.0 + t * t))
    w = half * half
    s = 1.0 / 13.0 - w * (1.0 / 15.0 - w * (1.0 / 17.0 - w / 19.0))
    s = 1.0 / 5.0 - w * (1.0 / 7.0 - w * (1.0 / 9.0 - w * (1.0 / 11.0 - w * s)))
    return 2.0 * half * (1.0 - w * (1.0 / 3.0 - w * s))


def _angle_below_eighth(y, x):
    """Angle of the point of pairs (x, y), 0 < y <= x, as a pair: a guess, turned back by itself."""
    guess = _first_guess(y[0] / x[0])
    s, c = _sine_series((guess, 0.0)), _cosine_series((guess, 0.0))
    across = _plus(_times(y, c), _negative(_times(x, s)))
    u = across[0] / (x[0] * c[0] + y[0] * s[0])
    return _sum(guess, u - u * u * u / 3.0)


def _angle(y, x, is_left):
    """Angle of the point (x, y) of pairs above 0; `is_left`: with -x in the place of x."""
    if y[0] > x[0]:
        found = _plus(_HALF_PI, _negative(_angle_below_eighth(x, y)))
    else:
        found = _angle_below_eighth(y, x)
    return _plus(_PI, _negative(found))[0] if is_left else found[0]


def portable_atan2(y, x):
    """Angle of the point (x, y) [rad], -pi to pi."""
    if math.isnan(x) or math.isnan(y):
        return math.nan
    is_left = math.copysign(1.0, x) < 0.0
    a, b = math.fabs(y), math.fabs(x)
    if math.isinf(a) and math.isinf(b):
        return math.copysign(2.356194490192345 if is_left else 0.7853981633974483, y)
    if a == 0.0 or math.isinf(b):
        return math.copysign(_PI[0] if is_left else 0.0, y)
    if b <= _HUGE_RATIO * a:
        return math.copysign(_HALF_PI[0], y)
    if a <= _HUGE_RATIO * b:
        return math.copysign(_PI[0] if is_left else a / b, y)
    scale = 1.0
    if max(a, b) > _LARGEST:
        scale = _DOWN
    elif max(a, b) < _LEAST:
        scale = _UP
    return math.copysign(_angle((scale * a, 0.0), (scale * b, 0.0), is_left), y)


def portable_atan(x):
    """Inverse tangent [rad]."""
    return portable_atan2(x, 1.0)


def _leg(x):
    """The square root of 1 - x^2 as a pair."""
    z = _times(_exact_sum(1.0, -x), _exact_sum(1.0, x))
    root = math.sqrt(z[0])
    square = _product(root, root)
    return _sum(root, ((z[0] - square[0]) + (z[1] - square[1])) / (2.0 * root))


def portable_asin(x):
    """Inverse sine [rad]; NaN beyond 1."""
    a = math.fabs(x)
    if a < _TINY or math.isnan(x):
        return x
    if a >= 1.0:
        return math.copysign(_HALF_PI[0], x) if a == 1.0 else math.nan
    return math.copysign(_angle((a, 0.0), _leg(a), False), x)


def portable_acos(x):
    """Inverse cosine [rad]; NaN beyond 1."""
    a = math.fabs(x)
    if a > 1.0 or math.isnan(x):
        return math.nan
    if a == 1.0:
        return _PI[0] if x < 0.0 else 0.0
    if a <= _HUGE_RATIO:
        return _HALF_PI[0]
    return _angle(_leg(a), (a, 0.0), x < 0.0)


#: Functions of the library that the export has portable ones for.
PORTABLE = {
    "sin": portable_sin, "cos": portable_cos, "asin": portable_asin, "acos": portable_acos,
    "atan": portable_atan, "atan2": portable_atan2,
}  # fmt: skip
