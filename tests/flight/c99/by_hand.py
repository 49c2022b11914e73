"""Kernels for one construct each, where a translator goes wrong most easily."""

import enum
import math
from types import FunctionType


def bump(memory, k, by):
    memory[k] += by
    return memory[k]


def is_up(memory, k):
    memory[k] += 1.0
    return memory[k] > 0.0


def whole(memory, k):
    memory[k] += 1.0
    return int(math.fmod(memory[k], 3.0)) % 3


def read_before_a_call_changes_it(x, y, n, m, v, memory):
    return memory[2] - bump(memory, 2, x), memory[2] * (memory[3] + bump(memory, 3, y))


def place_found_after_the_value(x, y, n, m, v, memory):
    memory[whole(memory, 1)] = memory[1] + x
    return memory[0], memory[1], memory[2]


def counters_compared(x, y, n, m, v, memory):
    for k in range(3):
        if k >= 1:
            x += memory[k]
        if k < 2:
            y -= memory[k]
    return x, y


def arguments_in_order(x, y, n, m, v, memory):
    return math.atan2(memory[1], bump(memory, 1, x)), min(memory[0], bump(memory, 0, 1.0))


def comparison_in_order(x, y, n, m, v, memory):
    return memory[0] < bump(memory, 0, x), memory[1] < bump(memory, 1, y) < memory[1] + x


def second_truth_is_not_asked(x, y, n, m, v, memory):
    first = x > y and is_up(memory, 0)
    second = x > y or is_up(memory, 1)
    return first, second, (n > m and is_up(memory, 2)) or (x < 0.0 and is_up(memory, 3))


def last_comparison_is_not_made(x, y, n, m, v, memory):
    return x < y < bump(memory, 0, 1.0), n < m < 3 < bump(memory, 1, 1.0)


def other_choice_is_not_made(x, y, n, m, v, memory):
    return bump(memory, 0, x) if n > m else bump(memory, 1, y), memory[0]


def index_before_value(x, y, n, m, v, memory):
    memory[whole(memory, 5)] += bump(memory, 1, x)
    memory[whole(memory, 5)] = bump(memory, 2, y)
    return memory[0], memory[1]


def place_is_found_once(x, y, n, m, v, memory):
    memory[int(math.fmod(memory[5], 2.0)) % 2] -= bump(memory, 5, 1.0)
    return memory[0], memory[1]


def targets_from_left_to_right(x, y, n, m, v, memory):
    k = 0
    k, memory[k] = 1, x
    memory[0], memory[1], memory[2] = memory[2], memory[0], memory[1]
    return float(k), memory[0]


def swapped(x, y, n, m, v, memory):
    x, y, n, m = y, x, m, n
    (x, y), v = (y + 1.0, x), (v[2], x, v[0])
    return x, y, n, m, v


def whole_is_kept_apart(x, y, n, m, v, memory):
    a = b = memory[0]
    memory[0] = memory[1] = a + x
    b += y
    return a, b


def from_the_end(x, y, n, m, v, memory):
    k, j = n % 6 - 6, m % 3 - 3
    memory[k] += x
    return memory[k], v[j], v[n % 5 - 2] if n % 5 < 5 else v[0], memory[-6]


def counter_set_in_its_loop(x, y, n, m, v, memory):
    total = 0
    for k in range(4):
        k = k * 2
        k += 1
        total += k
    return total, n


def counter_read_after_its_loop(x, y, n, m, v, memory):
    k = -9
    for k in range(n, m):
        x += float(k)
    for j in range(3):
        for j in range(j, j + 2):  # noqa: B020
            y += float(j)
    return k, x, y


def bounds_found_once(x, y, n, m, v, memory):
    end = m
    for k in range(n, end):
        end -= 1
        x += float(k)
    for _ in range(whole(memory, 4)):
        memory[4] += 1.0
        y += 1.0
    return x, y, end


def loops_by_steps(x, y, n, m, v, memory):
    total = 0
    for k in range(n, m, 3):
        total = total * 7 % 1009 + k
    for k in range(m, n, -2):
        total = total * 7 % 1009 + k
    for _ in range(3, 3):
        total = -1
    return total, x


def loop_left_and_gone_on(x, y, n, m, v, memory):
    for k in range(6):
        if k == n:
            continue
        if memory[k] > x:
            break
        memory[k] = y
    turns = 0
    while turns < 9 and x < 3.0 and is_up(memory, 5):
        turns += 1
        x += 1.0
        if x > y:
            continue
        y -= 0.5
    return x, y


def rounds_down(x, y, n, m, v, memory):
    if m == 0:
        return 0, 0, 0.0, 0.0
    return n // m, n % m, float(n) // m, n % float(m)


def signs(x, y, n, m, v, memory):
    return (
        -x,
        -(-x * 1.0),
        0.0 - x,
        x - (y - x),
        x / (y * x),
        -n,
        -(n - 3),
        n - (m - n),
        abs(x),
        abs(n),
    )


def bits_and_truths(x, y, n, m, v, memory):
    return n & m | 4 ^ n, (n > m) & (x > y), (x > y) == (n > m), bool(n) + m, not n, n > 0


def arguments_changed(x, y, n, m, v, memory):
    v = (v[1], v[2], v[0])
    n -= 1
    for n in range(n, 3):  # noqa: B020
        x -= float(n)
    return x, n, v


def large_changed(t, x):
    first = t[0]
    t = (x, *t[1:])
    return first, t[0], t[8], t[9]


def large_arguments(x, y, n, m, v, memory):
    return large_changed((*v, *v, *v, y), x), v


def large_changed_in_a_loop(t, x):
    total = 0.0
    for k in range(3):
        total += t[k]
        t = (t[0] + x, t[2], *t[:8])
    return total


def large_arguments_in_a_loop(x, y, n, m, v, memory):
    return large_changed_in_a_loop((*v, *v, *v, y), x), v


_GAIN = 2.0
EMPTY = ()


class Phase(enum.IntEnum):
    FIRST = 1
    LAST = 4


def _twice(x):
    return x + x


def first_of(cells):
    return cells[0] - cells[1]


def set_both(first, second, x):
    """Writes through one variable into either of two arrays."""
    cells = first
    for _ in range(2):
        cells[0] += x
        cells = second
    return x


def names_that_c_has_for_others(x, y, n, m, v, memory):
    GAIN = _GAIN * x
    exp, exp_ = x + 1.0, y * 2.0
    vec3 = (y, x, x)
    INT64_MAX, M_PI, size_t = exp + 1.0, 3.0 * y, 4.0
    twice = _twice(y) - GAIN
    return GAIN, exp, exp_, vec3, (vec3[0], x, y), INT64_MAX, M_PI, size_t, twice * _GAIN


def pieces_of_arrays(x, y, n, m, v, memory):
    piece = memory[2:5]
    piece[n % 3] += y
    memory[1:3][1] = x
    rest = memory[1:][2:]
    return memory[2:][0], rest[0], memory[1:][1:][n % 3], first_of(memory[1:][1:])


def variable_of_either_array(x, y, n, m, v, memory):
    before = memory[3]
    return before, memory[3] - set_both(memory[0:3], memory[3:6], x), memory[3]


def cells_set_to_what_is_in_them(x, y, n, m, v, memory):
    memory[:] = memory[n % 6] + x
    total = memory[5]
    memory[:] = bump(memory, 1, y) * 2.0
    return total


def chain_in_which_a_call_changes(x, y, n, m, v, memory):
    first = x <= memory[0] < bump(memory, 0, 1.0) < bump(memory, 1, y) < memory[1]
    kept = -9 < n < memory[4] + 1.0 < bump(memory, 4, 9.0)
    return first, kept, x < bump(memory, 2, 1.0) < y != bump(memory, 3, 1.0), 0 < n < m <= 5 != n


def loops_over_nothing_and_forever(x, y, n, m, v, memory):
    for k in EMPTY:
        x += k
    turns = 0
    while True:
        turns += 1
        for k in range(6):
            if memory[k] > y:
                break
            y -= 0.5
        if turns > n:
            return turns, x, y, n == Phase.FIRST, n + Phase.LAST


def loop_without_an_end_left(x, y, n, m, v, memory):
    turns = 0
    while True:
        turns += 1
        if turns > n:
            break
        x += memory[turns % 6]
    return turns, x


def numbers_of_seventeen_digits(x, y, n, m, v, memory):
    return x + 0.30000000000000004, y - 1.1000000000000003, 100000000000000.02 - x


def least_and_greatest(x, y, n, m, v, memory):
    return min(x, y), max(x, y), min(v[0], v[1], v[2]), max(v[2], v[1], v[0]), min(n, m), max(m, n)


def whole_numbers_by_zero(x, y, n, m, v, memory):
    zero = n - n
    return n // zero, n % zero


BY_HAND = [
    kernel
    for name, kernel in list(globals().items())
    if isinstance(kernel, FunctionType)
    and kernel.__code__.co_varnames[:6] == ("x", "y", "n", "m", "v", "memory")
]
