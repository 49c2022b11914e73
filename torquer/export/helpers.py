"""Functions that the C text has of its own: Python's division, least and greatest, places."""

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
/* a // b as Python has it: the greatest whole number not above the quotient */
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
/* a // b of whole numbers as Python has it: rounded down */
static int64_t floor_div_int(int64_t a, int64_t b)
{
    const int64_t quotient = a / b;
    return ((a % b != 0) && ((a < 0) != (b < 0))) ? quotient - 1 : quotient;
}""",
    "floor_mod_int": """\
/* a % b of whole numbers as Python has it: the sign is that of b */
static int64_t floor_mod_int(int64_t a, int64_t b)
{
    const int64_t rest = a % b;
    return ((rest != 0) && ((rest < 0) != (b < 0))) ? rest + b : rest;
}""",
    "power_of": """\
/* a ** b by the library, whatever a compiler knows of the exponent */
static double power_of(double a, double b)
{
    const volatile double exponent = b;
    return pow(a, exponent);
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
    "place_of": """\
/* place of an index among n: a negative one counts from the end, as in Python */
static int64_t place_of(int64_t index, int64_t n)
{
    return (index < 0) ? index + n : index;
}""",
}


def _of_library(name: str, arguments: str) -> str:
    """A function of the library, or the portable one where the build asks for it."""
    taken = ", ".join(f"double {each}" for each in arguments)
    given = ", ".join(arguments)
    return f"""\
/* {name}: the library's, or with ADCS_PORTABLE the one whose bits are the same everywhere */
static double {name}_of({taken})
{{
#ifdef ADCS_PORTABLE
    return portable_{name}({given});
#else
    return {name}({given});
#endif
}}"""


HELPERS |= {
    f"{name}_of": _of_library(name, arguments)
    for name, arguments in {
        "sin": "x", "cos": "x", "asin": "x", "acos": "x", "atan": "x", "atan2": "yx",
    }.items()
}  # fmt: skip
