"""Words that mean something in C: no variable of a kernel may have them as its name."""

import re

from torquer.flight.c99.helpers import NAMES
from torquer.flight.c99.prefix import is_of_prefix
from torquer.flight.c99.texts import names_around
from torquer.flight.c99.types import KEYWORDS

_LIBRARY = """
    int64_t uint64_t main stdin stdout stderr memcpy memset abs labs div exit sqrt sin cos tan asin
    acos atan atan2 exp exp2 expm1 log log1p log2 log10 logb sinh cosh tanh asinh acosh atanh fmod
    copysign fabs pow floor ceil trunc round rint fmin fmax fdim fma hypot cbrt erf erfc tgamma
    lgamma remainder remquo scalbn ldexp frexp modf nan nextafter ilogb sqrtf fabsf fmodf copysignf
    floorf ceilf truncf
"""
#: What kernels that may fail are handed what has failed as.
FAILURES_NAME = "failures"
#: Words of C, and names of its library, that a kernel's variable must not have.
RESERVED = KEYWORDS | frozenset(_LIBRARY.split()) | NAMES | {FAILURES_NAME}
#: Names of macros and types of the headers, and of macros of compilers.
_OF_HEADERS = re.compile(
    r"(PTRDIFF|SIZE|WCHAR|WINT|SIG_ATOMIC|U?INT(_LEAST|_FAST)?(8|16|32|64|MAX|PTR))_(MAX|MIN|C|WIDTH)"
    r"|u?int(_least|_fast)?(8|16|32|64|max|ptr)_t|(size|wchar|ptrdiff|max_align|float|double)_t"
    r"|HUGE|HUGE_VAL[FL]?|M_\w+|FP_\w+|MATH_\w+|math_\w+|ADCS_\w+|offsetof|linux|unix"
)
#: Names of the files around the kernels, and of the tables in them: a global name of a kernel's
#: must not be one.
AROUND = frozenset({*names_around(), "constants", "gate", "first", "fresh", "is_region", "mode_of"})


def avoid_headers(name: str) -> str:
    """A name that no header has."""
    return f"own_{name}" if _is_of_headers(name) else name


def _is_of_headers(name: str) -> bool:
    return _OF_HEADERS.fullmatch(name) is not None or is_of_prefix(name)


def is_reserved(name: str) -> bool:
    """Whether a name means something else in C."""
    return name in RESERVED or _is_of_headers(name)
