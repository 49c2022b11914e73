"""Kernels that leave their tables, divide by zero or leave 64 bits for some of their numbers."""

import math
from types import FunctionType

import numba

TABLE = (0.5, 1.5, -2.5)


@numba.njit
def picked(memory, k):
    return memory[k]


@numba.njit
def whole(x):
    return int(x)


@numba.njit
def inverse(x):
    return 1.0 / x


@numba.njit
def mean_of(memory, count):
    total = 0.0
    for k in range(count):
        total += memory[k]
    return total / count


def index_by_a_reading(x, y, n, m, v, memory):
    k = int(x * y) - 1
    memory[k] += 1.0
    return TABLE[k % 3], v[n], memory[k]


def index_of_a_tuple(x, y, n, m, v, memory):
    memory[0] = 7.0
    return v[n] + TABLE[m]


def index_of_a_callee(x, y, n, m, v, memory):
    memory[1] = picked(memory, n) + 1.0
    return memory[1], picked(memory, m - n)


def index_that_is_not_evaluated(x, y, n, m, v, memory):
    first = memory[n] if 0 <= n < 6 else 0.0
    second = x > y and memory[m] > 0.0
    third = memory[int(y)] if x > 0.0 else v[n % 3]
    return first, second, third


def index_one_too_far(x, y, n, m, v, memory):
    memory[0] = v[m % 4]
    return memory[n % 7], memory[-1 - (m % 7)]


def index_clamped(x, y, n, m, v, memory):
    k = min(max(int(x), 0), 5)
    memory[k] = y
    return memory[min(abs(n % 7), 5)], memory[n & 3], memory[max(-6, min(m, 5))], v[(n % 6) // 2]


def loop_that_runs_out_of_its_table(x, y, n, m, v, memory):
    k = n
    while memory[k] < x:
        memory[k] = x
        k += 1
    return k


def loop_over_as_many(x, y, n, m, v, memory):
    memory[5] = 2.0
    return mean_of(memory, n)


def cells_from_a_place_on(x, y, n, m, v, memory):
    piece = memory[2:]
    piece[n] = x
    return memory[1:4][m], piece[0]


def division_by_zero(x, y, n, m, v, memory):
    memory[0] = 3.0
    a = x / y
    memory[1] = 4.0
    return a, x // y, x % y, inverse(y), n / m


def division_of_whole_numbers(x, y, n, m, v, memory):
    memory[0] = 3.0
    return n // m, n % m, (n - 1) // m, (n - 1) % m


def division_in_place(x, y, n, m, v, memory):
    memory[2] /= y
    total = n
    total //= m
    return total


def made_whole(x, y, n, m, v, memory):
    return int(x), math.floor(y), math.ceil(x), math.trunc(y), whole(x), int(x) // -1, int(y) % -1


def whole_of_constants(x, y, n, m, v, memory):
    return whole(1e30), whole(-1e30), whole(math.inf), whole(math.nan), whole(9.2e18), whole(-0.7)


def least_and_greatest(x, y, n, m, v, memory):
    least, greatest = whole(-1e300), -(whole(-1e300) + 1)
    return (
        least, greatest, -least, abs(least), least - 1, greatest + 1, greatest * 3, least * -1,
        least // -1, least % -1, least // n if n != 0 else 0, greatest % m if m != 0 else 0,
        n + greatest, m - greatest, n + 1 > n, float(greatest + n), greatest + 1 < greatest,
    )  # fmt: skip


def hash_of_whole_numbers(x, y, n, m, v, memory):
    s = (n * 1103515245 + 12345) % 2147483648
    h = s
    for k in range(4):
        h = h * 4503599627370449 + k
    return s, h, float(h), h % 1000003


def loops_near_the_ends(x, y, n, m, v, memory):
    least, greatest = whole(-1e300), -(whole(-1e300) + 1)
    count, last = 0, 0
    for k in range(greatest - 7, greatest, 3):
        count += 1
        last = k
    for k in range(least + 5, least, -2):
        count += 1
        last = last * 3 + k
    for k in range(whole(x), whole(x) + 4, 3):
        count += 1
        if count > 40:
            break
        last += k
    return count, last


GUARDED = [
    kernel
    for kernel in list(globals().values())
    if isinstance(kernel, FunctionType) and kernel.__code__.co_varnames[:1] == ("x",)
]
