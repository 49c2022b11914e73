"""Functions that the C text has of its own: Python's division, least and greatest, places."""

import re

from torquer.flight.c99.precision import is_single

#: C text of each, by name; only those that are used are printed.
HELPERS = {
    "floor_mod": """\
/* a % b as Python has it: the sign is that of b */
static double floor_mod(double a, double b)
{
    double rest = fmod(a, b);
    if (b == 0.0) {
        return rest;
    }
    if (rest != 0.0) {
        if ((b < 0.0) != (rest < 0.0)) {
            rest += b;
        }
    } else {
        rest = copysign(0.0, b);
    }
    return rest;
}""",
    "floor_div": """\
/* quotient as Python rounds it: the greatest whole number that is not above it */
static double floor_div(double a, double b)
{
    const double rest = fmod(a, b);
    double quotient = (a - rest) / b;
    double whole;
    if (b == 0.0) {
        return a / b;
    }
    if (rest != 0.0 && (b < 0.0) != (rest < 0.0)) {
        quotient -= 1.0;
    }
    if (quotient == 0.0) {
        return copysign(0.0, a / b);
    }
    whole = floor(quotient);
    if (quotient - whole > 0.5) {
        whole += 1.0;
    }
    return whole;
}""",
    "floor_div_int": """\
/* quotient of whole numbers as Python has it: rounded down; 0 where b is 0 */
static int64_t floor_div_int(int64_t a, int64_t b)
{
    const int64_t quotient = (b != 0) ? a / b : 0;
    return ((b != 0) && (a % b != 0) && ((a < 0) != (b < 0))) ? quotient - 1 : quotient;
}""",
    "floor_mod_int": """\
/* a % b of whole numbers as Python has it: the sign is that of b; 0 where b is 0 */
static int64_t floor_mod_int(int64_t a, int64_t b)
{
    const int64_t rest = (b != 0) ? a % b : 0;
    return ((rest != 0) && ((rest < 0) != (b < 0))) ? rest + b : rest;
}""",
    "power_of": """\
/* a ** b by the library, whatever a compiler knows of the two */
static REAL power_of(REAL a, REAL b)
{
    const volatile double base = TO_DOUBLEa;
    const volatile double exponent = TO_DOUBLEb;
    return TO_REALpow(base, exponent);
}""",
    "min_of": """\
/* the first of two numbers unless the second is less: what Python does with NaN and -0.0 */
static double min_of(double a, double b)
{
    return (b < a) ? b : a;
}""",
    "max_of": """\
/* the first of two numbers unless the second is greater: what Python does with NaN and -0.0 */
static double max_of(double a, double b)
{
    return (b > a) ? b : a;
}""",
    "min_of_int": """\
/* the lesser of two whole numbers */
static int64_t min_of_int(int64_t a, int64_t b)
{
    return (b < a) ? b : a;
}""",
    "max_of_int": """\
/* the greater of two whole numbers */
static int64_t max_of_int(int64_t a, int64_t b)
{
    return (b > a) ? b : a;
}""",
    "abs_int": """\
/* magnitude of a whole number */
static int64_t abs_int(int64_t a)
{
    return (a < 0) ? -a : a;
}""",
    "sign_of": """\
/* -1, 0 or 1 by the sign of a number, NaN of NaN, as NumPy's sign */
static double sign_of(double a)
{
    if (isnan(a) != 0) {
        return a;
    }
    return (a > 0.0) ? 1.0 : ((a < 0.0) ? -1.0 : 0.0);
}""",
    "int_of": """\
/* a without its fraction; of NaN and of numbers beyond 64 bits the least whole number */
static int64_t int_of(double a)
{
    const double least = -9.223372036854775808e18;
    return (int64_t)(((a >= least) && (a < -least)) ? a : least);
}""",
    "place_of": """\
/* place of an index among n: a negative one counts from the end, as in Python */
static int64_t place_of(int64_t index, int64_t n)
{
    return (index < 0) ? index + n : index;
}""",
}


def _call_library(name: str, arguments: str) -> str:
    """A function of the library, or the portable one where the build asks for it."""
    taken = ", ".join(f"REAL {each}" for each in arguments)
    given = ", ".join(f"TO_DOUBLE{each}" for each in arguments)
    return f"""\
/* {name}: the library's, or with ADCS_PORTABLE the one whose bits are the same everywhere */
static REAL {name}_of({taken})
{{
#ifdef ADCS_PORTABLE
    return TO_REALportable_{name}({given});
#else
    return TO_REAL{name}({given});
#endif
}}"""


HELPERS |= {
    f"{name}_of": _call_library(name, arguments)
    for name, arguments in {
        "sin": "x", "cos": "x", "asin": "x", "acos": "x", "atan": "x", "atan2": "yx",
    }.items()
}  # fmt: skip
#: Those that exist a second time, for times, in a program of single precision.
_OF_TIMES = ("floor_mod", "floor_div", "min_of", "max_of", "sign_of", "int_of")
#: All names of these functions.
NAMES = frozenset({*HELPERS, *(f"{name}_times" for name in _OF_TIMES)})


def helper_texts() -> dict[str, str]:
    """The functions by their names, in the precision of the program."""
    if not is_single():
        words = {"REAL": "double", "TO_DOUBLE": "", "TO_REAL": ""}
        return {name: _fill(text, words) for name, text in HELPERS.items()}
    words = {"REAL": "float", "TO_DOUBLE": "(double)", "TO_REAL": "(float)"}
    exact = {
        f"{name}_times": HELPERS[name].replace(f" {name}(", f" {name}_times(") for name in _OF_TIMES
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
