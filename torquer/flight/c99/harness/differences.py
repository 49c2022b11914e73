"""Differences between two records of the same steps: python3 differences.py RECORD ANSWERS.

A record is what `replay.c` reads and writes. RECORD holds the answers of the simulation, which
computes in double precision; ANSWERS those of another build, after the same inputs.
"""

import math
import struct
import sys
from pathlib import Path

HEAD = struct.Struct("<8sQQQ")
DEGREE = math.pi / 180.0
#: What is compared: first and last column among the answers, unit.
VECTORS = {
    "dipole": (0, 3, "A m^2", 1.0), "torque": (3, 6, "N m", 1.0),
    "estimated rate": (10, 13, "deg/s", DEGREE),
}  # fmt: skip
ATTITUDE = slice(6, 10)


def answers_in(file: Path) -> list:
    """Answers of all steps: command, then estimate."""
    data = file.read_bytes()
    _, steps, inputs, _ = HEAD.unpack_from(data)
    row = struct.Struct(f"<{1 + inputs + 13}dQ")
    rows = row.iter_unpack(data[HEAD.size : HEAD.size + steps * row.size])
    return [each[1 + inputs : -1] for each in rows]


def angle_between(a: tuple, b: tuple) -> float:
    """Angle [rad] of the turn from one attitude to another; NaN where one is unknown."""
    (ax, ay, az, aw), (bx, by, bz, bw) = a, b
    x = aw * bx - bw * ax + az * by - ay * bz
    y = aw * by - bw * ay + ax * bz - az * bx
    z = aw * bz - bw * az + ay * bx - ax * by
    w = ax * bx + ay * by + az * bz + aw * bw
    return 2.0 * math.atan2(math.sqrt(x * x + y * y + z * z), abs(w))


def distance(a: tuple, b: tuple) -> float:
    """Length of the difference of two vectors."""
    return math.sqrt(sum((x - y) * (x - y) for x, y in zip(a, b, strict=True)))


def difference_row(what: str, unit: str, found: list) -> str:
    """Root mean square and greatest of all differences that are known, as a row of a table."""
    known = [(size, step) for step, size in enumerate(found) if math.isfinite(size)]
    if not known:
        return f"| {what} | never known | |\n"
    mean = math.sqrt(sum(size * size for size, _ in known) / len(known))
    most, step = max(known, key=lambda each: (each[0], -each[1]))
    return f"| {what} [{unit}] | {mean:.3g} | {most:.3g}, at step {step} |\n"


def table(record: Path, answers: Path) -> str:
    """The differences of all steps as a table."""
    before, after = answers_in(record), answers_in(answers)
    pairs = list(zip(before, after, strict=True))
    turns = [angle_between(a[ATTITUDE], b[ATTITUDE]) / DEGREE for a, b in pairs]
    text = f"| difference over {len(pairs)} steps | root mean square | greatest |\n|---|---|---|\n"
    text += difference_row("estimated attitude", "deg", turns)
    for what, (first, last, unit, size) in VECTORS.items():
        found = [distance(a[first:last], b[first:last]) / size for a, b in pairs]
        text += difference_row(what, unit, found)
    alone = sum(math.isnan(a[6]) != math.isnan(b[6]) for a, b in pairs)
    return text + f"| steps with an attitude in one of them alone | {alone} | |\n"


if __name__ == "__main__":
    print(table(*map(Path, sys.argv[1:3])), end="")
