"""Words that mean something in C: no variable of a kernel may have them as its name."""

import re

from torquer.flight.c99.helpers import NAMES
from torquer.flight.c99.prefix import is_of_prefix
from torquer.flight.c99.texts import names_around
from torquer.flight.c99.types import KEYWORDS

_MATHS = """
    sqrt sin cos tan asin acos atan atan2 exp exp2 expm1 log log1p log2 log10 logb sinh cosh tanh
    asinh acosh atanh fmod copysign fabs pow floor ceil trunc round rint fmin fmax fdim fma hypot
    cbrt erf erfc tgamma lgamma remainder remquo scalbn ldexp frexp modf nan nextafter ilogb
"""
_LIBRARY = """
    int64_t uint64_t main stdin stdout stderr memcpy memset abs labs div exit sqrtf fabsf fmodf
    copysignf floorf ceilf truncf
"""
#: Other functions of maths, in C99 or beyond it, and of strings: a variable may have their names.
_MORE_MATHS = """
    lrint llrint lround llround nearbyint nexttoward scalbln drem finite gamma isinf isnan j0 j1 jn
    lgamma_r scalb significand y0 y1 yn
"""
_MORE = """
    isgreater isgreaterequal isless islessequal islessgreater isnormal isunordered signgam
    bcmp bcopy bzero explicit_bzero ffs ffsl ffsll index lgammaf_r lgammal_r locale_t memccpy memchr
    memcmp memmove rindex stpcpy stpncpy strcasecmp strcasecmp_l strcat strchr strcmp strcoll
    strcoll_l strcpy strcspn strdup strerror strerror_l strerror_r strlen strncasecmp strncasecmp_l
    strncat strncmp strncpy strndup strnlen strpbrk strrchr strsep strsignal strspn strstr strtok
    strtok_r strxfrm strxfrm_l
"""
#: What kernels that may fail are handed what has failed as.
FAILURES_NAME = "failures"
#: Words of C, and names of its library, that a kernel's variable must not have.
RESERVED = KEYWORDS | frozenset(f"{_MATHS} {_LIBRARY}".split()) | NAMES | {FAILURES_NAME}
#: Names of macros and types of the headers, and of macros of compilers.
_OF_HEADERS = re.compile(
    r"(PTRDIFF|SIZE|WCHAR|WINT|SIG_ATOMIC|U?INT(_LEAST|_FAST)?(8|16|32|64|MAX|PTR))_(MAX|MIN|C|WIDTH)"
    r"|u?int(_least|_fast)?(8|16|32|64|max|ptr)_t|(size|wchar|ptrdiff|max_align|float|double)_t"
    r"|HUGE|HUGE_VAL[FL]?|(DBL|FLT|LDBL)_\w+|DECIMAL_DIG|M_\w+|FP_\w+|MATH_\w+|math_\w+|ADCS_\w+|offsetof|_[A-Z_]\w*"
)
#: Names of the files around the kernels, and of the tables in them: a global name of a kernel's
#: must not be one.
AROUND = frozenset({*names_around(), "constants", "gate", "first", "fresh", "is_region", "mode_of"})
#: Names that headers declare: neither must a global name of a kernel's be one.
DECLARED = frozenset(_MORE.split()) | {
    f"{name}{end}" for name in f"{_MATHS} {_MORE_MATHS}".split() for end in ("", "f", "l")
}


def avoid_headers(name: str) -> str:
    """A name that C can have and no header has; other letters become their numbers."""
    name = "".join(each if re.match(r"\w", each, re.ASCII) else _plain(each) for each in name)
    return f"own_{name}" if _is_of_headers(name) else name


def _plain(sign: str) -> str:
    return f"u{ord(sign):x}" if sign.isalpha() else "_"


def _is_of_headers(name: str) -> bool:
    return _OF_HEADERS.fullmatch(name) is not None or is_of_prefix(name)


def is_reserved(name: str) -> bool:
    """Whether a name means something else in C."""
    return name in RESERVED or _is_of_headers(name)
