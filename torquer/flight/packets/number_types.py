"""How numbers of packets are packed: the one table of their types.

u1 to u64 (whole, from 0), i2 to i64 (two's complement), f16, f32, f64 (IEEE 754), `bytes` as they
are, and `pad`: bits that mean nothing. Fields, codec, documentation, XTCE (both ways), DBC and Open
MCT follow from it.
"""

from typing import NamedTuple

import numpy as np


class Type(NamedTuple):
    """How a number is packed. `letter`: u, i, f; s of bytes, x of padding; `bits`: its width.

    `low`, `high`: least and greatest raw number; `code`: its letter in `struct`, "" if it has none.
    """

    letter: str
    bits: int
    low: float
    high: float
    code: str

    @property
    def is_whole(self) -> bool:
        """Whether raw numbers are whole."""
        return self.letter in "ui"


_CODES = {8: "b", 16: "h", 32: "i", 64: "q"}


def _types() -> dict[str, Type]:
    found = {}
    for n in range(1, 65):
        found[f"u{n}"] = Type("u", n, 0, 2**n - 1, _CODES.get(n, "").upper())
        if n > 1:
            found[f"i{n}"] = Type("i", n, -(2 ** (n - 1)), 2 ** (n - 1) - 1, _CODES.get(n, ""))
    for n, code in ((16, "e"), (32, "f"), (64, "d")):
        high = float(np.finfo(f"f{n // 8}").max)
        found[f"f{n}"] = Type("f", n, -high, high, code)
    return found | {"bytes": Type("s", 8, 0, 255, "s"), "pad": Type("x", 1, 0, 0, "")}


#: Every type by its name.
TYPES = _types()
