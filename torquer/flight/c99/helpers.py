"""Functions that the C text has of its own: Python's division, least and greatest, places."""

import re

from torquer.flight.c99.portable import PORTABLE
from torquer.flight.c99.precision import is_single
from torquer.flight.c99.texts import read_template


def _read_functions() -> dict[str, str]:
    """C text of each function of `templates/helpers.c`, with a comment before it, by its name."""
    texts = read_template("helpers.c").strip().split("\n\n")
    return {re.findall(r"^static \w+ (\w+)\(", text, re.M)[0]: text for text in texts}


def _call_library(name: str, arguments: str) -> str:
    """A function of the library; the portable one, if there is one, where the build asks for it.

    A compiler that knew an argument would work out the answer itself, and round otherwise than the
    library: volatile hides it.
    """
    taken = ", ".join(f"REAL {each}" for each in arguments)
    hidden = "".join(
        f"    const volatile double given_{each} = TO_DOUBLE{each};\n" for each in arguments
    )
    given = ", ".join(f"given_{each}" for each in arguments)
    body, said = f"{hidden}    return TO_REAL{name}({given});\n", "the library's"
    if name in PORTABLE:
        said = "the library's, or with ADCS_PORTABLE the one whose bits are the same everywhere"
        plain = ", ".join(f"TO_DOUBLE{each}" for each in arguments)
        portable = f"    return TO_REALadcs_portable_{name}({plain});\n"
        body = f"#ifdef ADCS_PORTABLE\n{portable}#else\n{body}#endif\n"
    comment = f"/* {name}: {said}, whatever a compiler knows of its argument */"
    return f"{comment}\nstatic REAL {name}_of({taken})\n{{\n{body}}}"


#: Functions of the library whose last bit is the library's own, with names of their arguments.
LIBRARY = {
    **dict.fromkeys(
        ("sin", "cos", "tan", "asin", "acos", "atan", "exp", "expm1", "log", "log1p", "log2",
         "log10", "sinh", "cosh", "tanh"), "x",
    ),
    "atan2": "yx",
}  # fmt: skip
#: C text of each, by name; only those that are used are printed.
HELPERS = _read_functions() | {
    f"{name}_of": _call_library(name, arguments) for name, arguments in LIBRARY.items()
}
#: Those that exist a second time, for times, in a program of single precision.
_OF_TIMES = (
    "floor_mod", "floor_div", "min_of", "max_of", "sign_of", "int_of",
    *(f"{name}_of" for name in LIBRARY),
)  # fmt: skip
#: What differs in the text of a function of doubles.
_DOUBLES = {"REAL": "double", "TO_DOUBLE": "", "TO_REAL": ""}
#: All names of these functions.
NAMES = frozenset({*HELPERS, *(f"{name}_times" for name in _OF_TIMES)})


def helper_texts() -> dict[str, str]:
    """The functions by their names, in the precision of the program."""
    if not is_single():
        return {name: _fill(text, _DOUBLES) for name, text in HELPERS.items()}
    words = {"REAL": "float", "TO_DOUBLE": "(double)", "TO_REAL": "(float)"}
    exact = {
        f"{name}_times": _fill(HELPERS[name].replace(f" {name}(", f" {name}_times("), _DOUBLES)
        for name in _OF_TIMES
    }
    return exact | {
        name: _fill(text, words) if "TO_REAL" in text else _in_single(text)
        for name, text in HELPERS.items()
    }


def _fill(text: str, words: dict[str, str]) -> str:
    """The text of a function that is written for both precisions."""
    return re.sub(r"TO_DOUBLE|TO_REAL|\bREAL\b", lambda found: words[found[0]], text)


def _in_single(text: str) -> str:
    """The text of a function of doubles for floats."""
    text = re.sub(r"\bdouble\b", "float", text)
    text = re.sub(r"\b(\d+\.\d+(?:e\d+)?)\b", r"\1f", text)
    return re.sub(r"\b(fmod|copysign|floor)\(", r"\1f(", text)
