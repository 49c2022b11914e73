"""The prefix of an export's names: files, functions, types, macros.

Texts are written with `adcs`; they leave with the prefix of the user's choice. What a user has
written himself (names of states, of files) is `kept` as it is.
"""

import contextlib
import re
from collections.abc import Iterator
from contextvars import ContextVar

DEFAULT = "adcs"
_PREFIX = ContextVar("prefix", default=DEFAULT)
_AS_WRITTEN = re.compile(r"(?<![\w\0])(lib|-D)?(adcs|ADCS)(?=_|\b)")
_A_NAME = re.compile(r"[a-z][a-z0-9]*(_[a-z0-9]+)*")
#: Headers of C, and first words of names that its headers, compilers or CMake have.
_WORDS = """
    assert complex ctype errno fenv float inttypes iso646 limits locale math setjmp signal
    stdalign stdarg stdatomic stdbool stddef stdint stdio stdlib stdnoreturn string tgmath
    threads time uchar wchar wctype unistd atomic mtx cnd tss thrd memory pthread posix linux
    unix std int uint char schar shrt ushrt long llong dbl flt ldbl sig fe fp lc m c huge size
    ptrdiff wint clocks rand exit buf eph own test all install clean help package replay
    replay_array break case const continue default do double else enum extern for goto if inline
    register restrict return short signed sizeof static struct switch typedef union unsigned
    void volatile while bool true false class new delete namespace template this using
"""
_TAKEN = frozenset(_WORDS.split())
_MUST = "a name of C that is not taken: small letters, digits, single underscores between them"


def check_prefix(prefix: str) -> None:
    """ValueError of one line for what cannot begin all names of an export."""
    is_name = isinstance(prefix, str) and _A_NAME.fullmatch(prefix) and len(prefix) <= 31
    if not is_name or prefix in _TAKEN:
        raise ValueError(f"prefix: must be {_MUST}; received {prefix!r}")


@contextlib.contextmanager
def named_with(prefix: str) -> Iterator[None]:
    """Within the block programs are translated and texts are written for a prefix."""
    token = _PREFIX.set(prefix)
    try:
        yield
    finally:
        _PREFIX.reset(token)


def is_of_prefix(name: str) -> bool:
    """Whether a name begins as those of the interface do."""
    return _PREFIX.get() != DEFAULT and name.lower().startswith(f"{_PREFIX.get()}_")


def kept(text: str) -> str:
    """A text of the user's, which the prefix does not change."""
    return re.sub(r"(?i)(?=adcs)", "\0", text)


def with_prefix(text: str) -> str:
    """A text as it leaves."""
    words = {DEFAULT: _PREFIX.get(), DEFAULT.upper(): _PREFIX.get().upper()}
    return _AS_WRITTEN.sub(lambda m: f"{m[1] or ''}{words[m[2]]}", text).replace("\0", "")


def files_with_prefix(files: dict) -> dict:
    """Names and texts of files as they leave; bytes stay."""
    return {
        with_prefix(name): with_prefix(each) if isinstance(each, str) else each
        for name, each in files.items()
    }
