"""Exports on other processors, of either byte order, with and without floating point: same bits.

`pip install unicorn ziglang` brings what these tests need: an emulator, and a compiler.
"""

import math
import struct
from functools import lru_cache
from random import Random

import numpy as np
import pytest
from flight.c99.in_c import bits
from flight.c99.test_generated import SPECIAL

pytest.importorskip("unicorn", reason="not installed: unicorn")

from flight.c99 import processors
from flight.c99.processors import PROCESSORS, Machine, replay_image, replayed
from flight.c99.test_export import EXAMPLES

import torquer

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not processors.HAS_ZIG, reason="not installed: ziglang"),
]
#: A lone B-dot; a filter of magnetometer and gyro; three axes by wheels, with a filter and modes.
STEPS = {"tip_off_campaign": 200, "magneto_gyro_micro": 60, "turn_to_the_sun": 60}
#: Numbers of a step in the record beside the inputs: begun anew, command, estimate, mark.
BESIDE = 1 + 6 + 7 + 1
HEAD = 4
#: Processors on which zig's software divides: quotients below the least normal number are cut off,
#: where others round them.
BY_ZIG, QUOTIENT, LEAST_NORMAL = ("Cortex-M4F", "RV32IMAC"), 3, 2.0**-1022
#: What a processor does with two numbers, and with a whole one.
ARITHMETIC = """
#include <stdint.h>
int board_main(void);
double given[2];
int64_t whole;
double found[20];
double sqrt(double);
int board_main(void)
{
    const double a = given[0], b = given[1];
    found[0] = a + b;
    found[1] = a - b;
    found[2] = a * b;
    found[3] = a / b;
    found[4] = __builtin_fabs(a);
    found[5] = -a;
    found[6] = a < b;
    found[7] = a <= b;
    found[8] = a == b;
    found[9] = a >= b;
    found[10] = a > b;
    found[11] = a != b;
    found[12] = (double)(float)a;
    found[13] = (double)whole;
    found[14] = (double)(int32_t)whole;
    found[15] = (double)(uint64_t)whole;
    found[16] = (double)((float)a * (float)b);
    found[17] = (double)(int64_t)((a > -9e18 && a < 9e18) ? a : 0.0);
    found[18] = (double)(int32_t)((b > -2e9 && b < 2e9) ? b : 0.0);
    found[19] = sqrt(a);
    return 0;
}
"""


def by_numpy(a: float, b: float, n: int) -> list[float]:
    """What `ARITHMETIC` finds."""
    x, y, single = np.float64(a), np.float64(b), np.float32
    with np.errstate(all="ignore"):
        return [
            x + y, x - y, x * y, x / y, abs(x), -x, a < b, a <= b, a == b, a >= b, a > b, a != b,
            float(single(x)), float(n), float(np.int64(n).astype(np.int32)),
            float(n % 2**64), float(single(x) * single(y)), float(int(a) if abs(a) < 9e18 else 0),
            float(int(b) if abs(b) < 2e9 else 0), np.sqrt(x),
        ]  # fmt: skip


def numbers() -> list[tuple[float, float, int]]:
    """All pairs of special numbers, and many others."""
    random = Random(11)

    def number() -> float:
        return random.uniform(-4.0, 4.0) * 10.0 ** random.randint(-40, 40)

    whole = [0, -1, 2**53 + 1, -(2**63), 2**63 - 1, 2**31]
    pairs = [(a, b, whole[k % 6]) for k, a in enumerate(SPECIAL) for b in SPECIAL]
    return pairs + [(number(), number(), random.getrandbits(64) - 2**63) for _ in range(400)]


@pytest.mark.parametrize("name", PROCESSORS)
def test_the_emulated_processor_computes_as_this_one(name, tmp_path):
    processor = PROCESSORS[name]
    (tmp_path / "arithmetic.c").write_text(ARITHMETIC)
    made = processors.objects(processor, tmp_path, [tmp_path / "arithmetic.c"])
    machine = Machine(processor, processors.linked(processor, tmp_path, made))
    order = machine.elf.order
    for a, b, n in numbers():
        machine.write("given", struct.pack(f"{order}2d", a, b))
        machine.write("whole", struct.pack(f"{order}q", n))
        machine.call("board_main")
        found = [*struct.unpack(f"{order}20d", machine.read("found", 160))]
        expected = [float(x) for x in by_numpy(a, b, n)]
        if name in BY_ZIG and 0.0 <= abs(found[QUOTIENT]) < LEAST_NORMAL:
            found[QUOTIENT] = rounded_away(found[QUOTIENT], expected[QUOTIENT])
        assert [*map(bits, found)] == [*map(bits, expected)], (a, b, n)


def rounded_away(found: float, expected: float) -> float:
    """The expected number if the found one is it, or the next towards zero."""
    return expected if found in (expected, math.nextafter(expected, 0.0)) else found


@pytest.fixture(scope="module")
def image(tmp_path_factory):
    """`image(processor, scenario, *flags)`: its replay as an image, the record; each made once."""

    @lru_cache
    def export(name: str):
        folder = tmp_path_factory.mktemp(name)
        scenario = torquer.load_scenario(EXAMPLES / f"{name}.toml")
        torquer.export_c(scenario, folder, steps=STEPS[name])
        return folder

    @lru_cache
    def made(processor: str, name: str, *flags: str):
        folder = tmp_path_factory.mktemp("image")
        record = (export(name) / "test/recorded.bin").read_bytes()
        return replay_image(PROCESSORS[processor], export(name), folder, *flags), record

    return made


def said_of(steps: int) -> str:
    return f"{steps} control steps: the same bits in commands and state\n"


@pytest.mark.parametrize("scenario", STEPS)
@pytest.mark.parametrize("name", PROCESSORS)
def test_a_recorded_flight_has_the_same_bits(image, name, scenario):
    program, record = image(name, scenario)
    done = replayed(Machine(PROCESSORS[name], program), record)
    assert (done.code, done.said) == (0, said_of(STEPS[scenario]))


def numbers_of(record: bytes) -> tuple[list[int], np.ndarray, list[int]]:
    """The head of a record, its numbers with one NaN for all, and its marks; the lowest byte of
    each is the first."""
    head = struct.unpack_from("<4Q", record)
    words = np.frombuffer(record, "<u8", offset=8 * HEAD).reshape(head[1], head[2] + BESIDE)
    floats = words[:, :-1].view("<f8")
    return [*head], np.where(np.isnan(floats), math.nan, floats).view("<u8"), words[:, -1].tolist()


@pytest.mark.parametrize("scenario", ["magneto_gyro_micro", "tip_off_campaign"])
@pytest.mark.parametrize("name", PROCESSORS)
def test_the_answers_are_the_record_byte_by_byte(image, name, scenario):
    program, record = image(name, scenario)
    done = replayed(Machine(PROCESSORS[name], program), record, answers=True)
    assert (done.code, done.said) == (0, f"{STEPS[scenario]} control steps: written\n")
    assert len(done.answers) == len(record)
    for found, expected in zip(numbers_of(done.answers), numbers_of(record), strict=True):
        np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("name", ["PowerPC 750", "RV32IMAC"])
def test_a_record_in_the_image_has_the_same_bits(image, name):
    program, _ = image(name, "tip_off_campaign", "-DADCS_RECORDED")
    done = replayed(Machine(PROCESSORS[name], program))
    assert (done.code, done.said) == (0, said_of(40))


@pytest.mark.parametrize("name", ["Cortex-M4F", "PowerPC 750"])
def test_another_bit_is_noticed(image, name):
    program, record = image(name, "tip_off_campaign")
    inputs = struct.unpack_from("<Q", record, 16)[0]
    at = 8 * (HEAD + 7 * (inputs + BESIDE) + 1 + inputs)  # the dipole along x at step 7
    spoiled = record[:at] + bytes([record[at] ^ 1]) + record[at + 1 :]
    done = replayed(Machine(PROCESSORS[name], program), spoiled)
    assert (done.code, done.said) == (1, f"the first difference is at step 7 of {len_of(record)}\n")


def len_of(record: bytes) -> int:
    return struct.unpack_from("<Q", record, 8)[0]


def test_a_record_whose_words_begin_with_the_highest_byte_is_another(image):
    program, record = image("PowerPC 750", "tip_off_campaign")
    swapped = np.frombuffer(record, "<u8").byteswap().tobytes()
    done = replayed(Machine(PROCESSORS["PowerPC 750"], program), swapped)
    assert (done.code, done.said) == (2, "the record is of another export\n")
